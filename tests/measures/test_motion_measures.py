"""Measures of motion, on motions whose measures are known."""

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.measures.walks import gait_measures


def test_cadence_stance_and_step_length_of_a_known_walk_are_exact(holden31: Skeleton) -> None:
    """A figure with a stiff right knee, an arm that swings through 40 degrees and a trunk that leans."""
    frames = 240
    t = 2 * np.pi * np.arange(frames) / 60
    local = np.tile([1.0, 0, 0, 0], (frames, len(holden31.joints), 1))
    axis = np.array([1.0, 0, 0])
    local[:, holden31.role("left_knee")] = quat.from_axis_angle(axis, 0.5 + 0.5 * np.sin(t))
    down = quat.from_axis_angle([0, 0, 1.0], -np.pi / 2)
    local[:, holden31.role("left_shoulder")] = quat.mul(
        quat.from_axis_angle(axis, np.radians(20) * np.sin(t)), down
    )
    local[:, holden31.role("right_shoulder")] = quat.from_axis_angle([0, 0, 1.0], np.pi / 2)
    local[:, holden31.index("LowerBack")] = quat.from_axis_angle([0, 0, 1.0], -0.2)
    positions = forward_kinematics(holden31, local, np.tile([0.0, 93, 0], (frames, 1)))[1]
    contacts = np.zeros((frames, 4))
    for start in range(0, frames, 60):
        contacts[start + 5 : start + 41, 0] = 1
        contacts[start + 35 : start + 59, 3] = 1
    travelled = np.array([0.0, 0, 2.0]) * np.arange(frames)[:, None]
    found = gait_measures(holden31, positions, contacts, travelled)
    heels = positions[:, [holden31.role("left_heel"), holden31.role("right_heel")], 2]
    exact = {
        "speed": 120,
        "stance_left": 0.6,
        "stance_right": 0.4,
        "stance_asymmetry": 0.4,
        "knee_right": 0,
        "arm_right": 0,
        "hip_height": 93,
        "step_left": (heels[5::60, 0] - heels[5::60, 1]).mean(),
        "step_right": (heels[35::60, 1] - heels[35::60, 0]).mean(),
    }
    assert {key: found[key] for key in exact} == pytest.approx(exact, abs=1e-6)
    angles = {"knee_left": np.degrees(1.0), "arm_left": 40, "lean_left": np.degrees(0.2)}
    assert {key: found[key] for key in angles} == pytest.approx(angles, rel=0.05), "5th to 95th percentile"
