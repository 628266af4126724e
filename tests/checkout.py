"""A copy of the checkout in which tests run the commands of the README, and may change everything."""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass
class Workflow:
    """A clone of the checkout, with the results of its runs. places: further folders of Python's path."""

    folder: Path
    places: tuple[Path, ...] = ()

    def command(self, *arguments: str) -> list[str]:
        """The command of the README, `snakemake -c2 results/...`, without other options."""
        return [str(Path(sys.executable).with_name("snakemake")), *arguments]

    def how(self) -> dict[str, Any]:
        """Arguments of subprocess: the folder, and a user's variables."""
        path = [str(self.folder / "src"), *map(str, self.places), os.environ.get("PYTHONPATH", "")]
        own = {"PYTHONPATH": os.pathsep.join(filter(None, path)), "PYTHONDONTWRITEBYTECODE": "1"}
        return {"cwd": self.folder, "env": {**os.environ, **own}}

    def start(self, *arguments: str, said: Path | None = None) -> subprocess.Popen[bytes]:
        """Start it in its own session without waiting. Its output goes to the file `said`."""
        with open(said or os.devnull, "wb") as out:
            streams: dict[str, Any] = {"stdout": out, "stderr": subprocess.STDOUT, "start_new_session": True}
            return subprocess.Popen(self.command(*arguments), **self.how(), **streams)

    def run(self, *arguments: str, ok: bool = True) -> str:
        """Run snakemake and return stdout and stderr. Fails the test if its success is not `ok`."""
        done = subprocess.run(
            self.command(*arguments), **self.how(), capture_output=True, text=True, timeout=3600
        )
        text = done.stdout + done.stderr
        assert (done.returncode == 0) is ok, text
        return text

    def planned(self, *arguments: str) -> dict[str, int]:
        """Rule -> number of jobs that a dry run plans."""
        text = self.run("-n", *arguments)
        table = re.search(r"^Job stats:\n(.*?)\ntotal", text, re.M | re.S)
        rows = re.findall(r"^\w+ +(\w+) +(\d+) ", table[1], re.M) if table else []
        return {rule: int(count) for rule, count in rows}

    def edit(self, file: str, old: str, new: str) -> None:
        path = self.folder / file
        text = path.read_text()
        assert old in text, f"{file} has no {old!r}"
        path.write_text(text.replace(old, new, 1))

    def own_source(self) -> Path:
        """Make the package a copy that may be edited, and return its folder."""
        source = self.folder / "src"
        real = source.resolve()
        source.unlink()
        shutil.copytree(real, source, ignore=shutil.ignore_patterns("__pycache__"))
        return source / "hobble"


def copy_of(root: Path, folder: Path, *places: Path) -> Workflow:
    """Rules are copied and the package is linked, so that numba's cache is found."""
    checkout = folder / "checkout"
    checkout.mkdir(parents=True)
    shutil.copy2(root / "Snakefile", checkout)
    for part in ("config", "profiles", "workflow"):
        shutil.copytree(root / part, checkout / part)
    (checkout / "src").symlink_to(root / "src")
    return Workflow(checkout, places)
