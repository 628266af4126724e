"""Waypoints: the track, how the character follows it, and when it has arrived."""

import numpy as np
import pytest

from hobble.runtime import ProceduralAnimation, waypoints
from hobble.runtime.waypoints import Follower, Waypoint

SQUARE = (
    Waypoint((0.0, 1000.0), "walk", 2.5),
    Waypoint((1000.0, 1000.0), "jog", 7.0, (0.0, 1.0)),
    Waypoint((1000.0, 0.0), "crouch", 2.0),
    Waypoint((0.0, 0.0), "walk", 2.5),
)


def test_a_point_that_follows_its_target_reaches_all_waypoints(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(waypoints, "ARRIVED", 20.0)
    follower = Follower(SQUARE)
    place = follower.start[0][None]
    assert follower.start[1] == 0.0
    frames = [0]
    while follower.reached[0] < 8:
        velocity, _, (gait,) = follower.lead(place)
        waypoint = next(w for w in SQUARE if w.speed == pytest.approx(np.hypot(*velocity[0])))
        assert waypoint.gait == gait
        place = place + velocity
        frames[-1] += 1
        if follower.reached[0] == len(frames):
            frames.append(0)
        assert follower.off_path[0] <= 20.0
    expected = 1000 / np.array([2.5, 7.0, 2.0, 2.5])
    np.testing.assert_allclose(frames[4:8], expected, rtol=0.03)


def test_the_character_follows_waypoints(network) -> None:
    character = ProceduralAnimation(network, waypoints=SQUARE, steering=0.0)
    pose = character.next_pose()
    np.testing.assert_allclose(pose.root, 0, atol=1e-9)
    np.testing.assert_allclose(character.state.smoothed_velocity, [[0, 0.9 * 2.5]])
    character.follower.reached[:] = 1
    character.next_pose()
    assert character._targets._shares[0].tolist() == [0, 0, 1, 0, 0, 0]
    # On the way to the second it strafes, facing +Z.
    np.testing.assert_allclose(character.state.smoothed_direction, [[0, 1]], atol=1e-9)
    assert character.state.strafe[0] > 0.5
    # A velocity of the caller's own takes precedence.
    character.next_pose((0.0, -1.0))
    np.testing.assert_allclose(character._targets._shares[0], np.eye(6)[1])
