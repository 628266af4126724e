"""What the tests of strangers' files share: a short BVH file, and a read that must be refused."""

import os
import resource
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hobble.core.errors import HobbleError
from hobble.core.skeleton import Skeleton
from hobble.synthetic.generate_clip import Synthetic, write_clip
from tests.conftest import ROOT

MB = 1 << 20
SKELETON = ROOT / "config/skeletons/holden31.yaml"
SECONDS = 10  # of the processor; every hostile file is refused in less


@pytest.fixture(scope="session")
def tiny_bvh(holden31: Skeleton, tmp_path_factory: pytest.TempPathFactory) -> str:
    """A BVH file of a second and a half."""
    folder = tmp_path_factory.mktemp("walk")
    paths = {key: folder / f"{key}.bvh" for key in ("bvh", "footsteps", "gait")}
    write_clip("walk", holden31.to_dict(), 600, None, Synthetic(fps=120, seed=1), **paths)
    head, _, rest = paths["bvh"].read_text().partition("Frames:")
    _, time, *rows = rest.strip().split("\n")
    return f"{head}Frames: 180\n{time}\n" + "\n".join(rows[:180]) + "\n"


def outcome(act: Callable[[], Any]) -> str:
    """What a call said in a process of its own: "done", "refused: " and a HobbleError, or another error."""
    read_end, write_end = os.pipe()
    pid = os.fork()
    if not pid:
        said = "done"
        try:
            act()
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
    assert not os.WIFSIGNALED(status), f"ended by signal {os.WTERMSIG(status)}"
    return said


def refused(read: Callable[[], Any], *pieces: str, mb: int = 300, letters: int = 2000) -> None:
    """`read` raises a HobbleError with these pieces, in less than `mb` of memory and SECONDS."""

    def limited() -> None:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        most = pages * os.sysconf("SC_PAGE_SIZE") + mb * MB
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
        read()

    said = outcome(limited)
    assert said.startswith("refused: "), said[:2000]
    for piece in pieces:
        assert piece in said, said[:2000]
    assert len(said) < letters, len(said)


def write(path: Path, text: str | bytes) -> Path:
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path
