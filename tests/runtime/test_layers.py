"""Other animation on top of a pose: a wave, a look, a frame of a clip; the network goes on undisturbed."""

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.skeleton import local_rotations
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.caller_targets import Axes
from tests.runtime.walking import same_poses, walk


def facing(character: ProceduralAnimation, pose) -> np.ndarray:
    """Where the face points, in the caller's axes."""
    ahead = character.axes.directions_to_caller(np.array([0.0, 0.0, 1.0]))
    return quat.rotate(pose.rotations[..., character.skeleton.role("head"), :], ahead)


@pytest.mark.parametrize("axes", [Axes(), Axes("left", "Z", "m"), Axes("right", "Z")])
@pytest.mark.parametrize("rig", [None, "mixamo55"])
def test_a_character_waves_and_looks_while_it_walks(network, axes: Axes, rig: str | None) -> None:
    waving, plain = (ProceduralAnimation(network, axes=axes, rig=rig) for _ in range(2))
    skeleton, up = waving.skeleton, axes.directions_to_caller(np.array([0.0, 1.0, 0.0]))
    shoulder, elbow, wrist = (skeleton.roles[f"right_{part}"] for part in ("shoulder", "elbow", "wrist"))
    ahead = axes.directions_to_caller(np.array([0.0, 0.0, 1.0]))
    for _ in range(40):
        pose = waving.next_pose(0.02 * ahead)
        raised = waving.layers.aim(pose, shoulder, elbow, up)
        raised = waving.layers.aim(raised, elbow, wrist, up + 0.3 * ahead)
        point = pose.positions[skeleton.role("head")] + (2 * ahead + up) * 100 * axes.scale
        raised = waving.layers.look_at(raised, point)
        same_poses(pose, plain.next_pose(0.02 * ahead))  # what is put on top changes nothing below
    a, b, c = (raised.positions[skeleton.index(joint)] for joint in (shoulder, elbow, wrist))
    np.testing.assert_allclose((b - a) / np.linalg.norm(b - a), up, atol=1e-9)
    assert (c - b) @ up > 0.9 * np.linalg.norm(c - b)
    wanted = point - raised.positions[skeleton.role("head")]
    np.testing.assert_allclose(facing(waving, raised), wanted / np.linalg.norm(wanted), atol=1e-6)
    legs = [skeleton.role(f"{side}_{part}") for side in ("left", "right") for part in ("hip", "knee", "toe")]
    np.testing.assert_array_equal(raised.positions[legs], pose.positions[legs])
    for j, p in enumerate(skeleton.parents):  # bones keep their lengths
        if p >= 0:
            was, now = (np.linalg.norm(q.positions[j] - q.positions[p]) for q in (pose, raised))
            assert now == pytest.approx(was, abs=1e-9)


def test_parts_play_the_frame_of_another_clip(network) -> None:
    """For a crowd: the named joints get these local rotations, half of the way with half of the weight."""
    character = ProceduralAnimation(network, characters=3)
    pose, skeleton = walk(character, 20)[-1], character.skeleton
    arm = quat.from_axis_angle(np.array([1.0, 0, 0]), np.array([0.3, 0.6, 0.9]))
    local = {"RightForeArm": arm, "RightArm": quat.from_axis_angle([0.0, 0, 1.0], -0.8)}
    names = [skeleton.index(name) for name in local]
    before = local_rotations(skeleton, pose.rotations)
    wanted = np.stack([np.broadcast_to(q, (3, 4)) for q in local.values()], axis=1)
    full = quat.angle(before[:, names], wanted)
    for weight, least, most in ((1.0, 0.0, 0.0), (0.5, 0.0, 0.99), (0.0, 1.0, 1.0)):
        after = local_rotations(skeleton, character.layers.play(pose, local, weight).rotations)
        left = quat.angle(after[:, names], wanted)
        assert ((left >= least * full - 1e-6) & (left <= most * full + 1e-6)).all()
        others = np.setdiff1d(np.arange(31), names)
        assert quat.angle(after[:, others], before[:, others]).max() < 1e-6
