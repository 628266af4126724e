from __future__ import annotations

import base64
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body_mesh
from hobble.figure.pack import TURN
from hobble.report.recorded_motion import UNIT, pack_positions


def unpacked(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


def test_positions_are_packed_within_a_tenth_of_a_millimetre() -> None:
    rng = np.random.default_rng(0)
    world = rng.uniform(-90, 90, (7, 5, 3)) + rng.uniform(-4000, 4000, (7, 1, 3))
    packed = pack_positions(world)
    root = unpacked(packed["root"], "<f4").reshape(7, 1, 3)
    pose = unpacked(packed["pose"], "<i2").reshape(7, 5, 3)
    assert np.abs(root + pose * UNIT - world).max() < 0.01


def test_every_scenario_is_thinned_and_sweeps_are_left_out(play: dict[str, Any]) -> None:
    assert play["fps"] == 20
    walk = play["scenarios"][0]
    assert (walk["name"], walk["frames"]) == ("Walk", 200)
    assert len(unpacked(walk["pose"], "<i2")) == 200 * play["joints"] * 3
    assert play["joints"] < 31, "joints that are not drawn need not lie in the page"
    assert len(unpacked(walk["contacts"], "u1")) == 200
    assert "Left knee" not in [scene["name"] for scene in play["scenarios"]]


def test_packed_rotations_give_the_bones_and_their_lengths(play: dict[str, Any], holden31: Skeleton) -> None:
    walk, count = play["scenarios"][0], play["joints"]
    keep = body_mesh(holden31).bones.tolist()
    pose = UNIT * unpacked(walk["pose"], "<i2").reshape(-1, count, 3)
    turn = unpacked(walk["turn"], "<i2").reshape(-1, count, 4) / TURN
    assert np.abs(np.linalg.norm(turn, axis=-1) - 1).max() < 1e-3
    for upper, lower in (
        ("left_hip", "left_knee"),
        ("right_knee", "right_heel"),
        ("left_shoulder", "left_elbow"),
    ):
        a, b = holden31.role(upper), holden31.role(lower)
        reach = pose[:, keep.index(b)] - pose[:, keep.index(a)]
        assert np.abs(np.linalg.norm(reach, axis=-1) - np.linalg.norm(holden31.offsets[b])).max() < 0.03
        there = quat.rotate(turn[:, keep.index(a)], holden31.offsets[b])
        assert np.abs(there - reach).max() < 0.05
