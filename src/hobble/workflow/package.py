"""Tells rules on which files of the package `hobble` they depend, and computes hashes of its code.

The files are templates and scripts of HTML pages, and published results.
"""

from __future__ import annotations

import functools
from pathlib import Path

from hobble.workflow.fingerprint import fingerprint


class Package:
    """The package `hobble` in a checkout of the repository. base: the folder of the checkout."""

    def __init__(self, base: Path) -> None:
        self.base = base
        self.folder = base / "src" / "hobble"

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def code(self, script: str, *modules: str) -> str:
        """Hash of a rule's script and of everything that the script imports from the package.

        script: its name, without .py. modules: full names of modules that the script imports dynamically.
        """
        path = self.base / "workflow" / "scripts" / f"{script}.py"
        return fingerprint(path, self.base / "src", modules)

    def template_files(self) -> list[str]:
        """Paths of the HTML pages' templates and styles, and of the published results that the pages show.

        If one of these files changes, only the pages are made again.
        """
        kinds = {".j2", ".css", ".js", ".yaml"}
        files = [str(path) for path in (self.folder / "report").iterdir() if path.suffix in kinds]
        return sorted(files)

    def web_files(self, suffix: str) -> list[str]:
        """Paths of the report's files with a suffix: ".js" for scripts, ".json" for lists of npm packages."""
        files = [*(self.folder / "report" / "web").iterdir(), *self.folder.glob("models/**/*.js")]
        return sorted(str(path) for path in files if path.suffix == suffix)

    def published_file(self) -> str:
        """Path of the published results, such as errors and times, with which the report compares ours."""
        return str(self.folder / "report" / "published.yaml")
