"""Makes the virtual environment, with the command `python environment.py .venv`.

This script needs only Python 3.11 or later, and no package. It shows one line of progress: what pip
downloads, and how much of it has arrived.
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
DISK_SPACE = "2.0 GB"  # of the environment, measured on Linux with the present constraints.txt
PROGRESS_SECONDS = 10.0  # between lines of progress if the output goes to a file
# Arguments of each `pip install`. torch is first, because it is the largest package and the one that is most
# likely to be unavailable.
STEPS = (["torch==2.13.0"], ["--editable", ".[dev]"])
# Two kinds of lines that pip prints: the name and the size of a download that begins, and how many of its
# bytes have arrived.
DOWNLOAD_LINE = re.compile(r"\s*(?:Downloading|Using cached) (\S+?)(?:-\d\S*)? \(([\d.]+) (kB|MB|GB)\)")
PROGRESS_LINE = re.compile(r"Progress (\d+) of (\d+)")
BYTES = {"kB": 1e3, "MB": 1e6, "GB": 1e9}


class ProgressLine:
    """Shows the progress of pip in one line.

    On a terminal the line is overwritten. In a file a new line is written every PROGRESS_SECONDS or so.
    """

    def __init__(self, stream: TextIO) -> None:
        self.stream, self.on_terminal = stream, stream.isatty()
        self.finished_bytes = 0.0  # of the downloads before the present one
        self.name, self.size = "", 0.0  # the present download, and its size in bytes
        self.arrived = 0.0  # how many bytes of the present download have arrived
        self.last_written = float("-inf")  # time of the last line in a file

    def update(self, text: str) -> None:
        """Update the progress with a line of pip's output."""
        if found := DOWNLOAD_LINE.match(text):
            self.finished_bytes += self.size
            self.name, self.size, self.arrived = found[1], float(found[2]) * BYTES[found[3]], 0.0
        elif found := PROGRESS_LINE.match(text):
            self.arrived = float(found[1])
        elif text.startswith("Installing collected packages"):
            self.finished_bytes, self.size, self.arrived = self.finished_bytes + self.size, 0.0, 0.0
            self.name = f"unpacking {text.count(',') + 1} packages, which takes a while"
            self.last_written = float("-inf")  # write the line at once, because pip prints nothing after this
        else:
            return
        self._show()

    def _show(self) -> None:
        part = f" {self.arrived / 1e6:.0f} of {self.size / 1e6:.0f} MB" if self.size >= 1e6 else ""
        fetched = (self.finished_bytes + self.arrived) / 1e6
        text = f"environment: {fetched:.0f} MB fetched; {self.name}{part}"
        if self.on_terminal:
            self.stream.write(f"\r\x1b[K{text[:78]}")
        elif time.monotonic() - self.last_written >= PROGRESS_SECONDS:
            self.last_written = time.monotonic()
            self.stream.write(f"{text}\n")
        self.stream.flush()

    def end(self) -> None:
        """Clear the line on a terminal."""
        if self.on_terminal:
            self.stream.write("\r\x1b[K")


def follow(output: Iterable[str], line: ProgressLine) -> list[str]:
    """Show pip's output as progress. Returns its last lines, for an error message."""
    last_lines: list[str] = []
    for text in output:
        line.update(text)
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
        sys.exit(
            "".join(last_lines) + f"\nThe environment could not be made. pip failed: {' '.join(command)}"
        )


def is_sound(python: Path) -> bool:
    """Whether the interpreter `python` has pip and is of the same version as the one that runs this."""
    print_version = "import sys, pip; print(sys.version)"
    try:
        command = [str(python), "-c", print_version]
        found = subprocess.run(command, capture_output=True, text=True, check=True).stdout
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
    # A sound environment is left as it is, because venv would copy the interpreter. This fails while the
    # interpreter is in use.
    if not is_sound(python):
        venv.create(folder, with_pip=True)
    install(python, ["--quiet", "--upgrade", "pip>=25"], line)  # older versions print no progress lines
    for packages in STEPS:
        install(python, ["--progress-bar", "raw", "--constraint", "constraints.txt", *packages], line)
    print(f"The environment is ready after {time.monotonic() - began:.0f} s.")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
