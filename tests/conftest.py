"""Fixtures that every stage's tests may use."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import yaml

from hobble.core.skeleton import Skeleton

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def root() -> Path:
    """The checkout."""
    return ROOT


@pytest.fixture(scope="session")
def shared() -> Path:
    """The project's shared reference data (motion, original rows, released network), where it is."""
    folder = Path(os.environ.get("HOBBLE_SHARED", ROOT.parent / "shared"))
    if not (folder / "mocap" / "clips.csv").is_file():
        pytest.skip(f"no shared reference data at {folder} (set HOBBLE_SHARED to its folder)")
    return folder


@pytest.fixture(scope="session")
def holden31() -> Skeleton:
    """The 31-joint skeleton."""
    data = yaml.safe_load((ROOT / "config/skeletons/holden31.yaml").read_text())
    return Skeleton.from_dict({"name": "holden31", **{k: v for k, v in data.items() if k != "maps"}})
