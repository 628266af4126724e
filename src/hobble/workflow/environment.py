"""Makes the virtual environment: python environment.py .venv. It needs only Python 3.11 or later.

It shows one line of progress: what pip downloads, and how much of it has arrived.
"""

from __future__ import annotations

import re
import subprocess
import sys
import time
import venv
from collections.abc import Iterable
from pathlib import Path
from typing import TextIO

OLDEST_PYTHON = (3, 11)
DISK_SPACE = "2.0 GB"  # on Linux with the present constraints.txt
PROGRESS_SECONDS = 10.0  # between lines of progress if the output goes to a file
# Arguments of each pip install: torch first, because it is the largest and most likely to be unavailable.
STEPS = (["torch==2.13.0"], ["--editable", ".[dev]"])
# Lines of pip: a download begins (its name and size); how many of its bytes have arrived.
DOWNLOAD_LINE = re.compile(r"\s*(?:Downloading|Using cached) (\S+?)(?:-\d\S*)? \(([\d.]+) (kB|MB|GB)\)")
PROGRESS_LINE = re.compile(r"Progress (\d+) of (\d+)")
BYTES = {"kB": 1e3, "MB": 1e6, "GB": 1e9}


class ProgressLine:
    """The line of progress. On a terminal it is overwritten; in a file a new line is written now and then."""

    def __init__(self, stream: TextIO) -> None:
        self.stream, self.live = stream, stream.isatty()
        self.fetched = 0.0  # bytes of the finished downloads
        self.name, self.size = "", 0.0  # the present download and its bytes
        self.now = 0.0  # how many of these bytes have arrived
        self.last = float("-inf")  # time of the last line in a file

    def take(self, text: str) -> None:
        """Update the progress with a line of pip's output."""
        if found := DOWNLOAD_LINE.match(text):
            self.fetched += self.size
            self.name, self.size, self.now = found[1], float(found[2]) * BYTES[found[3]], 0.0
        elif found := PROGRESS_LINE.match(text):
            self.now = float(found[1])
        elif text.startswith("Installing collected packages"):
            self.fetched, self.size = self.fetched + self.size, 0.0
            self.name = f"unpacking {text.count(',') + 1} packages, which takes a while"
            self.last = float("-inf")  # show it at once, because pip prints nothing after this
        else:
            return
        self._show()

    def _show(self) -> None:
        of = f" {self.now / 1e6:.0f} of {self.size / 1e6:.0f} MB" if self.size >= 1e6 else ""
        text = f"environment: {(self.fetched + self.now) / 1e6:.0f} MB fetched; {self.name}{of}"
        if self.live:
            self.stream.write(f"\r\x1b[K{text[:78]}")
        elif time.monotonic() - self.last >= PROGRESS_SECONDS:
            self.last = time.monotonic()
            self.stream.write(f"{text}\n")
        self.stream.flush()

    def end(self) -> None:
        """Clear the line on a terminal."""
        if self.live:
            self.stream.write("\r\x1b[K")


def follow(output: Iterable[str], line: ProgressLine) -> list[str]:
    """Show pip's output as progress. Returns its last lines, for an error message."""
    last_lines: list[str] = []
    for text in output:
        line.take(text)
        if not PROGRESS_LINE.match(text):
            last_lines = [*last_lines[-30:], text]
    line.end()
    return last_lines


def install(python: Path, arguments: list[str], line: ProgressLine) -> None:
    """Run pip install. If it fails, exit with the last lines of its output."""
    command = [str(python), "-m", "pip", "install", "--disable-pip-version-check", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as pip:
        assert pip.stdout is not None
        last_lines = follow(pip.stdout, line)
    if pip.returncode:
        sys.exit("".join(last_lines) + f"\nThe environment could not be made: {' '.join(command)}")


def is_sound(python: Path) -> bool:
    """Whether `python` has pip and is of the same version as the Python that runs this."""
    version = "import sys, pip; print(sys.version)"
    try:
        found = subprocess.run([python, "-c", version], capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return False
    return found.strip() == sys.version


def main(folder: Path) -> None:
    """Make the environment in `folder`, or complete an existing one."""
    if sys.version_info < OLDEST_PYTHON:
        sys.exit("Hobble needs Python 3.11 or later: make env PYTHON=/path/to/python3.11")
    print(f"Making the environment in {folder}: PyTorch, Snakemake, SciPy and their dependencies.")
    print(f"This downloads packages and takes {DISK_SPACE} of disk, and a few minutes with a fast network.")
    began = time.monotonic()
    python, line = folder / "bin" / "python", ProgressLine(sys.stdout)
    # A sound environment is left as it is: venv would copy the interpreter, which fails while it is in use.
    if not is_sound(python):
        venv.create(folder, with_pip=True)
    install(python, ["--quiet", "--upgrade", "pip>=25"], line)  # older versions do not print progress
    for packages in STEPS:
        install(python, ["--progress-bar", "raw", "--constraint", "constraints.txt", *packages], line)
    print(f"The environment is ready after {time.monotonic() - began:.0f} s.")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
