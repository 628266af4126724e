"""Helpers for tests of files from strangers: a read must be refused in limited memory."""

from __future__ import annotations

import os
import resource
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hobble.core.errors import HobbleError

MB = 1 << 20
HEADER = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 1 Xposition\n"


SECONDS = 10  # of the processor; every hostile file of a few kilobytes is refused in less


def refused(read: Callable[[], Any], *pieces: str, mb: int = 300, letters: int = 2000) -> None:
    """`read` raises a HobbleError with these pieces, takes less than `mb` of memory and SECONDS of the
    processor. The error has fewer than `letters`.
    """
    read_end, write_end = os.pipe()
    pid = os.fork()
    if not pid:
        said = "nothing was refused"
        try:
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            most = pages * os.sysconf("SC_PAGE_SIZE") + mb * MB
            resource.setrlimit(resource.RLIMIT_AS, (most, most))
            resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
            read()
        except HobbleError as error:
            said = f"refused: {error}"
        except BaseException as error:
            said = f"{type(error).__name__}: {error}"
        finally:
            os.write(write_end, said.encode(errors="replace")[:60_000])
            os._exit(0)
    os.close(write_end)
    with os.fdopen(read_end, "rb") as pipe:
        said = pipe.read().decode()
    _, status = os.waitpid(pid, 0)
    assert not os.WIFSIGNALED(status), f"ended by signal {os.WTERMSIG(status)}: more than {SECONDS} s"
    assert said.startswith("refused: "), said[:2000]
    for piece in pieces:
        assert piece in said, said[:2000]
    assert len(said) < letters, len(said)


def write(path: Path, text: str | bytes) -> Path:
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path
