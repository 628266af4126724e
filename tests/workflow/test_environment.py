"""The output of `make env` while pip works."""

from __future__ import annotations

import io
import re
import subprocess
import sys
from pathlib import Path

from hobble.workflow import environment
from hobble.workflow.environment import ProgressLine, follow

SAID = """Collecting torch==2.13.0
  Downloading torch-2.13.0-cp311-none-linux.whl.metadata (31 kB)
Progress 31000 of 31000
Downloading torch-2.13.0-cp311-none-linux.whl (190.5 MB)
Progress 0 of 190500000
Progress 95250000 of 190500000
Progress 190500000 of 190500000
  Using cached numpy-2.3.0-cp311.whl (16.0 MB)
Installing collected packages: numpy, torch
Successfully installed numpy-2.3.0 torch-2.13.0
""".splitlines(keepends=True)


class Screen(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_on_a_terminal_one_line_shows_the_package_and_progress() -> None:
    screen = Screen()
    words = follow(SAID, ProgressLine(screen))
    shown = [text.partition("\x1b[K")[2] for text in screen.getvalue().split("\r")]
    assert "environment: 95 MB fetched; torch 95 of 190 MB" in shown
    assert "environment: 207 MB fetched; unpacking 2 packages, which takes a while"[:78] in shown
    assert "\n" not in screen.getvalue()
    assert shown[-1] == ""
    assert words[-1].startswith("Successfully installed")
    assert not any("Progress" in word for word in words)


def test_no_download_is_counted_twice() -> None:
    out = io.StringIO()
    follow([line for line in SAID if "cached" not in line], ProgressLine(out))
    assert out.getvalue().splitlines()[-1].startswith("environment: 191 MB fetched; unpacking")


def test_in_a_file_progress_is_printed_now_and_then() -> None:
    out = io.StringIO()
    follow(SAID * 20, ProgressLine(out))
    lines = out.getvalue().splitlines()
    assert len(lines) == 1 + 20  # and the unpacking at once, because pip prints nothing about it
    assert "unpacking 2 packages" in lines[-1]


def test_pips_last_lines_are_printed_if_it_fails(tmp_path: Path) -> None:
    script = f"import sys; sys.path.insert(0, {str(Path(environment.__file__).parents[2])!r})\n" + (
        "from pathlib import Path\nfrom hobble.workflow.environment import *\n"
        "install(Path(sys.executable), ['no-such-folder/x.whl'], ProgressLine(sys.stdout))\n"
    )
    end = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=tmp_path)
    assert end.returncode == 1
    assert "no-such-folder/x.whl" in end.stderr
    assert "The environment could not be made" in end.stderr


def test_it_imports_only_the_standard_library() -> None:
    """It imports only the standard library, because it runs before there is an environment."""
    imported = re.findall(r"^(?:from|import) (\w+)", Path(environment.__file__).read_text(), re.M)
    assert set(imported) <= set(sys.stdlib_module_names)


def test_the_torch_version_is_the_one_in_the_project_file(root: Path) -> None:
    assert f'"{environment.STEPS[0][0]}"' in (root / "pyproject.toml").read_text()


def test_a_working_environment_is_kept(tmp_path: Path) -> None:
    """venv copies the interpreter, which fails while a program runs in the environment."""
    assert environment.is_sound(Path(sys.executable))
    assert not environment.is_sound(tmp_path / "bin" / "python")
    other = tmp_path / "python"
    other.write_text("#!/bin/sh\necho '3.9.1 (another one)'\n")
    other.chmod(0o755)
    assert not environment.is_sound(other)
