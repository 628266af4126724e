"""Wrong arguments of `next_pose` are refused, and a failed call changes nothing."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.core.errors import InputError
from hobble.runtime import ProceduralAnimation
from hobble.runtime.waypoints import Waypoint
from tests.runtime.walking import KNEE, hills, same, walk


@pytest.mark.parametrize("injury", [{"LeftUpLeg-LeftLeg": 11}, {KNEE: -0.1}, {KNEE: np.nan}])
def test_a_severity_out_of_range_is_refused(hurtable, injury) -> None:
    with pytest.raises(ValueError, match=r"the severity of LeftUpLeg-LeftLeg is .* from 0 to 10"):
        ProceduralAnimation(hurtable).next_pose((0, 1), injury=injury)


def test_invalid_targets_are_refused(network) -> None:
    character = ProceduralAnimation(network, characters=2)
    with pytest.raises(ValueError, match="target_velocity is not a finite vector"):
        character.next_pose((0, np.nan))
    with pytest.raises(
        ValueError, match=r"facing has to be a vector of 2 or 3 .* each of 2, not of shape \(3, 2\)"
    ):
        character.next_pose((0, 1), np.ones((3, 2)))
    with pytest.raises(ValueError, match=r"target_velocity has to be a vector .* not of shape \(4,\)"):
        character.next_pose((0, 1, 2, 3))
    with pytest.raises(ValueError, match=r"terrain returned heights of shape \(2,\) for 72 points"):
        character.next_pose((0, 1), terrain=lambda x, z: np.zeros(2))
    for shares in (np.ones(5), [-1, 0, 0, 0, 0, 0], np.ones((3, 6), int), [np.inf, 0, 0, 0, 0, 0]):
        with pytest.raises(
            ValueError, match=r"gait shares have to be \(6,\) or \(2, 6\) .* order: stand, walk"
        ):
            character.next_pose((0, 1), gait=shares)
    with pytest.raises(ValueError, match="heights that are not finite"):
        character.next_pose((0, 1), terrain=lambda x, z: x * np.nan)
    with pytest.raises(ValueError, match="1 gaits for 2 characters"):
        character.next_pose((0, 1), gait=["walk"])
    for name, value in (
        ("characters", 0),
        ("steering", np.nan),
    ):
        with pytest.raises(ValueError, match=f"{name} is {value!r}, but has to be"):
            ProceduralAnimation(network, **{name: value})
    for name in ("rate", "scale"):
        with pytest.raises(ValueError, match=f"the {name} of injury is 0, but has to be more than 0"):
            ProceduralAnimation(network, **{f"{name}s": {"injury": 0}})
    with pytest.raises(KeyError, match=r"no gait 'jogging'; did you mean jog\?"):
        ProceduralAnimation(network, waypoints=[Waypoint((0, 0), "walk", 2), Waypoint((9, 0), "jogging", 2)])


def test_unknown_links_are_refused_by_name(hurtable, network) -> None:
    with pytest.raises(KeyError, match=r"^injury has no 'Tail': there are Hips-LHipJoint, "):
        ProceduralAnimation(hurtable).next_pose((0, 1), injury={"Tail": 1})
    with pytest.raises(
        KeyError, match=r"^injury has no 'LeftUpLeg-LeftFoot'; did you mean .*LeftUpLeg-LeftLeg"
    ):
        ProceduralAnimation(hurtable).next_pose((0, 1), injury={"LeftUpLeg-LeftFoot": 1})
    with pytest.raises(
        ValueError, match="no input for injury; train a configuration with `channels: \\[injury\\]`"
    ):
        ProceduralAnimation(network).next_pose((0, 1), injury={KNEE: 1})


def test_severities_of_another_shape_are_refused(hurtable, network) -> None:
    crowd = ProceduralAnimation(hurtable, characters=3)
    for injury in (np.ones((3, 30)), np.ones(30), {KNEE: [1, 2, 3]}, {KNEE: 4}, {}):
        crowd.next_pose((0, 1), injury=injury)
    with pytest.raises(ValueError, match=r"injury has to have shape \(30,\) or \(3, 30\), not \(29,\)"):
        crowd.next_pose((0, 1), injury=np.ones(29))
    with pytest.raises(
        ValueError, match=rf"{KNEE} has to be one severity for all .* 3, one for each; its shape is \(2,\)"
    ):
        crowd.next_pose((0, 1), injury={KNEE: [1, 2]})
    with pytest.raises(
        ValueError, match="30 numbers given for injury, but this network has no input for injury"
    ):
        ProceduralAnimation(network).next_pose((0, 1), injury=np.ones(30))


def test_a_network_without_skeleton_is_refused(tmp_path: Path, network) -> None:
    with pytest.raises(ValueError, match="skeleton"):
        ProceduralAnimation(replace(network, skeleton=None))
    with pytest.raises(InputError, match="no such file"):
        ProceduralAnimation.load(tmp_path / "missing.npz")


@pytest.mark.parametrize(
    ("targets", "message"),
    [
        ({"target_velocity": (1e30, 0)}, "faster than a body"),
        ({"target_velocity": (0, 31.0)}, "faster than a body"),
        ({"target_velocity": (np.nan, 0)}, "not a finite"),
        ({"gait": [0, 1e30, 0, 0, 0, 0]}, "from 0 to 1"),
        ({"gait": [0, -0.1, 0, 0, 0, 0]}, "from 0 to 1"),
        ({"terrain": lambda x, z: 1e30 + 0 * x}, "a height of 1e\\+30"),
        ({"terrain": lambda x, z: x * np.nan}, "not finite"),
        ({"terrain": lambda x, z: np.zeros(3)}, "heights of shape"),
        ({"injury": {KNEE: 10.5}}, "from 0 to"),
    ],
)
def test_impossible_targets_are_refused_and_change_nothing(hurtable, targets: dict, message: str) -> None:
    character = ProceduralAnimation(hurtable)
    walk(character, 5, injury={KNEE: 3.0})
    before = copy.deepcopy(character.state)
    with pytest.raises(ValueError, match=message):
        character.next_pose(**{"target_velocity": (0.5, 2.0), "injury": {KNEE: 9.0}, **targets})
    assert same(before, character.state)
    assert np.isfinite(character.next_pose((0.5, 2.0)).positions).all()


def test_a_start_too_far_from_the_origin_is_refused(network) -> None:
    with pytest.raises(ValueError, match="100 km"):
        ProceduralAnimation(network, position=(1e30, 0))


@pytest.mark.parametrize("call", range(2))
def test_a_terrain_that_raises_leaves_the_state_as_it_was(hurtable, call: int) -> None:
    """The terrain function fails at its first call (for the path) or at its second (for the feet)."""
    calm, troubled = ProceduralAnimation(hurtable), ProceduralAnimation(hurtable)
    calls = []

    def fails(x, z):
        calls.append(len(x))
        if len(calls) == 21 + call:
            raise RuntimeError("the level is not loaded")
        return hills(x, z)

    for character, ground in ((calm, hills), (troubled, fails)):
        walk(character, 10, terrain=ground)
    before = copy.deepcopy(troubled.state)
    with pytest.raises(RuntimeError, match="level"):
        troubled.next_pose((0.5, 2.0), terrain=fails, injury={KNEE: 8.0})
    assert same(before, troubled.state)
    a, b = (walk(c, 5, terrain=t)[-1] for c, t in ((calm, hills), (troubled, fails)))
    np.testing.assert_array_equal(a.positions, b.positions)


def test_a_failed_frame_leaves_no_trace(hurtable) -> None:
    """Both of the calls in a frame are tried, also in the first frame."""

    def hills(x, z):
        return 40 + 0.2 * z

    for failing in (0, 1, 40, 41):
        whole, disturbed = ProceduralAnimation(hurtable), ProceduralAnimation(hurtable)
        looks = iter(range(10**6))

        def once(x, z, looks=looks, failing=failing):
            if next(looks) == failing:
                raise OSError("gone")
            return hills(x, z)

        for frame in range(40):
            pose = whole.next_pose((0, 2.0), terrain=hills)
            if frame == failing // 2:
                with pytest.raises(OSError, match="gone"):
                    disturbed.next_pose((0, 2.0), terrain=once)
            again = disturbed.next_pose((0, 2.0), terrain=once)
            np.testing.assert_array_equal(again.positions, pose.positions)
            np.testing.assert_array_equal(again.root, pose.root)
