"""Fixtures of the fault tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from hobble.core.skeleton import Skeleton
from hobble.synthetic.generate_clip import write_clip
from hobble.synthetic.options import Synthetic

from .texts import base_bvh


@pytest.fixture(scope="session")
def tiny_bvh(holden31: Skeleton, tmp_path_factory: pytest.TempPathFactory) -> str:
    """A BVH file of a second and a half."""
    folder = tmp_path_factory.mktemp("walk")
    names = {"bvh": "a.bvh", "footsteps": "f.txt", "gait": "g.txt"}
    paths = {key: folder / name for key, name in names.items()}
    write_clip("walk", holden31.to_dict(), 600, None, Synthetic(fps=120, seed=1), **paths)
    return base_bvh(Path(paths["bvh"]))
