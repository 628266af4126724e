"""Compiled functions run without a cache: read-only folders, damaged files, a full disk."""

import os
import re
import subprocess
import sys
from pathlib import Path

MODULE = """
import warnings, sys
from hobble.core.compiled import njit

@njit
def twice(x):
    return 2 * x

@njit(fastmath=True)
def thrice(x):
    return 3 * x

print(twice(4), thrice(4.0))
"""


def run(folder: Path, **environment: str) -> subprocess.CompletedProcess:
    """Run the module in its own process, like an installed package."""
    (folder / "job.py").write_text(MODULE)
    source = Path(__file__).resolve().parents[2] / "src"
    keep = {key: value for key, value in os.environ.items() if not key.startswith("NUMBA")}
    variables = {**keep, "PYTHONPATH": str(source), "PYTHONDONTWRITEBYTECODE": "1", **environment}
    return subprocess.run(
        [sys.executable, "job.py"], cwd=folder, env=variables, capture_output=True, text=True, timeout=120
    )


def cached(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.nb[ic]"))


def test_compiled_code_is_cached_and_damaged_files_are_compiled_again(tmp_path):
    cache = str(tmp_path / "cache")
    first = run(tmp_path, NUMBA_CACHE_DIR=cache)
    assert (first.stdout, first.stderr) == ("8 12.0\n", "")
    files = {path: path.stat().st_mtime_ns for path in cached(tmp_path)}
    assert len(files) == 4
    assert run(tmp_path, NUMBA_CACHE_DIR=cache).stdout == "8 12.0\n"
    assert {path: path.stat().st_mtime_ns for path in cached(tmp_path)} == files
    for path, content in zip(files, (b"", b"rubbish", b"\x80\x04.", b""), strict=True):
        path.write_bytes(content)
    result = run(tmp_path, NUMBA_CACHE_DIR=cache)
    assert result.stdout == "8 12.0\n"
    assert result.stderr.count("RuntimeWarning") == 1


def test_no_writable_folder_gives_one_warning(tmp_path):
    """The cache folder lies below a file, so not even root can make it."""
    (tmp_path / "file").write_text("")
    (tmp_path / "__pycache__").write_text("")
    below = str(tmp_path / "file" / "cache")
    result = run(tmp_path, NUMBA_CACHE_DIR=below, HOME=below, XDG_CACHE_HOME=below)
    assert result.stdout == "8 12.0\n", result.stderr
    assert result.stderr.count("RuntimeWarning: compiled functions are not kept") == 1
    assert "NUMBA_CACHE_DIR" in result.stderr


def test_every_compiled_function_works_without_its_cache():
    """numba's own `njit(cache=True)` raises if it finds no folder that it can write."""
    source = Path(__file__).resolve().parents[2] / "src"
    found = {
        path.name for path in source.rglob("*.py") if re.search("numba(.| import )njit", path.read_text())
    }
    assert found == {"compiled.py"}
