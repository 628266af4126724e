from __future__ import annotations

import base64
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body_mesh
from hobble.report.recorded_motion import UNIT


def positions(clip: dict[str, Any], table: str, joints: int) -> np.ndarray:
    motion = clip[table]
    root = np.frombuffer(base64.b64decode(motion["root"]), "<f4").reshape(-1, 1, 3)
    return root + UNIT * np.frombuffer(base64.b64decode(motion["pose"]), "<i2").reshape(-1, joints, 3)


def test_captured_motion_is_recovered_from_the_page(
    compared: dict[str, Any], examples: ModuleType, holden31: Skeleton
) -> None:
    clip = compared["clips"][0]
    assert (clip["name"], clip["split"], clip["frames"]) == ("walk_turns", "held_out", 21)
    made = examples.walker(holden31, 200, 2.2)["positions"][60:121:3]
    found = positions(clip, "captured", compared["joints"])
    # The same motion, begun at the origin; the walker's path is straight up to its frame 66 and bends after.
    assert found[:, :, 1] == pytest.approx(
        _drawn(made, compared, holden31)[:, :, 1], abs=0.9
    )  # legs are not stretched out wholly
    step = np.linalg.norm(np.diff(found[:, 0, ::3], axis=0), axis=1)
    assert step == pytest.approx(np.linalg.norm(np.diff(made[:, 0, ::3], axis=0), axis=1), abs=1e-3)


def _drawn(made: np.ndarray, compared: dict[str, Any], skeleton: Skeleton) -> np.ndarray:
    keep = body_mesh(skeleton).bones
    assert len(keep) == compared["joints"]
    return made[:, keep]
