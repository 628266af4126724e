"""A reader stays within the configured memory, on a database ten times as large."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from hobble.database.write import write_database

STATED = 8  # MB
ROWS = 40_000
CHILD = """
import os, resource, sys, threading
from pathlib import Path
from hobble.database.reader import Database

path, stated, allowed = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
threading.stack_size(1 << 20)
next(Database.open(path, 0).blocks("train", 0, 0, 10, 1, 32))  # what the program needs for itself
size = next(int(line.split()[1]) << 10 for line in open("/proc/self/status") if line.startswith("VmSize"))
most = size + ((allowed + 2) << 20)  # and two threads' stacks
resource.setrlimit(resource.RLIMIT_AS, (most, most))
db = Database.open(path, stated)
for file in Path(path).rglob("*.safetensors"):
    with open(file, "rb") as opened:
        os.posix_fadvise(opened.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
print(sum(len(block.p) for block in db.blocks("train", 0, 1, 10, 1, db.block_rows(32))))
"""


@pytest.fixture(scope="module")
def large(rows_of, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database of 80 MB."""
    path = tmp_path_factory.mktemp("large") / "db"
    clips = {f"c{i:02d}": rows_of(f"c{i:02d}", 2500, 10, seed=i) for i in range(16)}
    splits = dict.fromkeys(clips, "train")
    write_database(path, clips, splits, channels=["injury"], joint_weight=0.1, chunk_bytes=300_000)
    assert sum(f.stat().st_size for f in path.rglob("*") if f.is_file()) > 10 * (STATED << 20)
    return path


def read_within(path: Path, stated: int, allowed: int) -> subprocess.CompletedProcess[str]:
    """A section read from a cold cache by a process that gets no more address space than `allowed` MB."""
    one_arena = {**os.environ, "MALLOC_ARENA_MAX": "1"}  # else each thread reserves 64 MB
    arguments = [sys.executable, "-c", CHILD, str(path), str(stated), str(allowed)]
    return subprocess.run(arguments, env=one_arena, capture_output=True, text=True, check=False)


@pytest.mark.skipif(sys.platform != "linux", reason="limits and /proc of Linux")
def test_a_section_is_read_under_a_hard_limit_on_address_space(large: Path) -> None:
    done = read_within(large, STATED, STATED)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) == ROWS
    done = read_within(large, 4 * STATED, STATED)  # one that took more than is stated would not get through
    assert done.returncode != 0
    assert "MemoryError" in done.stderr
