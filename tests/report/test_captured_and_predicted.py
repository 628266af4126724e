from __future__ import annotations

import base64
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body_mesh
from hobble.report.recorded_motion import UNIT, in_world
from hobble.rows.clip_rows import headings, root_path


def positions(clip: dict[str, Any], table: str, joints: int) -> np.ndarray:
    motion = clip[table]
    root = np.frombuffer(base64.b64decode(motion["root"]), "<f4").reshape(-1, 1, 3)
    return root + UNIT * np.frombuffer(base64.b64decode(motion["pose"]), "<i2").reshape(-1, joints, 3)


def test_a_root_that_moves_ahead_and_turns_goes_in_a_circle() -> None:
    frames = 360
    velocity, turn = np.tile([0.0, 1.0], (frames, 1)), np.full(frames, -2 * np.pi / frames)
    place, yaw = root_path(velocity, turn), headings(turn)
    assert yaw[90] == pytest.approx(np.pi / 2)  # a negative turn of the world is one to the left, to +X
    centre = place.mean(axis=0)
    assert np.linalg.norm(place - centre, axis=1) == pytest.approx(frames / (2 * np.pi), rel=1e-3)
    assert centre[0] > 0 == centre[1]
    ahead = in_world(np.tile([[0.0, 0, 1]], (frames, 1, 1)), place, yaw, np.zeros((frames, 1)))
    assert ahead[:-1, 0, ::3] == pytest.approx(place[1:, ::3], abs=1e-9)


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
