"""Files of the package that rules depend on: templates, scripts of the pages, published results, code."""

from __future__ import annotations

import functools
from pathlib import Path

from hobble.workflow.fingerprint import fingerprint


class Package:
    """The package `hobble` of a checkout. base: the checkout."""

    def __init__(self, base: Path) -> None:
        self.base = base
        self.folder = base / "src" / "hobble"

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def code(self, script: str, *modules: str) -> str:
        """Fingerprint of a rule's script and of everything that the script imports from the package.

        modules: full names of modules that the script imports dynamically.
        """
        path = self.base / "workflow" / "scripts" / f"{script}.py"
        return fingerprint(path, self.base / "src", modules)

    def templates(self) -> list[str]:
        """Templates and styles of the HTML pages, and the published results that the pages show.

        If one changes, only the pages are made again.
        """
        kinds = {".j2", ".css", ".js", ".yaml"}
        files = [str(path) for path in (self.folder / "report").iterdir() if path.suffix in kinds]
        return sorted([*files, self.published()])

    def web(self, suffix: str) -> list[str]:
        """Files of the report's page with this suffix, such as ".js" (scripts) or ".json" (npm packages)."""
        files = [*(self.folder / "report" / "web").iterdir(), *self.folder.glob("models/**/*.js")]
        return sorted(str(path) for path in files if path.suffix == suffix)

    def published(self) -> str:
        """The file of published results, such as errors and times, with which the report compares ours."""
        return str(self.folder / "evaluation" / "published.yaml")
