"""Two bones reach the target if they can, bend towards the pole, and keep their lengths."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hobble.core import quat
from hobble.core.skeleton import aim_bone, two_bone_knee

points = arrays(float, 3, elements=st.floats(-60, 60, allow_subnormal=False))
FORWARD = np.array([0.0, 0.0, 1.0])


@given(points, st.floats(20, 60), st.floats(20, 60))
def test_bones_keep_their_lengths_reach_what_is_in_reach_and_bend_towards_the_pole(target, upper, lower):
    distance = np.linalg.norm(target)
    if distance < 1 or np.linalg.norm(np.cross(target, FORWARD)) < 1:
        return
    knee, ankle = two_bone_knee(np.zeros(3), target, FORWARD, upper, lower)
    np.testing.assert_allclose(np.linalg.norm(knee), upper, rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(ankle - knee), lower, rtol=1e-6)
    if abs(upper - lower) * 1.002 + 1e-3 < distance < (upper + lower) * 0.998:
        np.testing.assert_allclose(ankle, target, atol=1e-6)
    assert np.linalg.norm(ankle) <= (upper + lower) * 0.999 + 1e-9
    along = ankle / np.linalg.norm(ankle)
    out, forward = (v - along * (v @ along) for v in (knee, FORWARD))
    if np.linalg.norm(out) > 1:
        assert out @ forward > 0
        np.testing.assert_allclose(np.cross(out, forward), 0, atol=1e-5)


@given(points, arrays(float, 4, elements=st.floats(-1, 1)))
def test_aim_points_the_bone_by_the_smallest_turn(direction, q):
    if np.linalg.norm(direction) < 1 or np.linalg.norm(q) < 0.1:
        return
    q, bone = quat.normalize(q), np.array([0.0, -40.0, 0.0])
    aimed = aim_bone(q, bone, direction)
    unit = direction / np.linalg.norm(direction)
    np.testing.assert_allclose(quat.rotate(aimed, bone) / 40.0, unit, atol=1e-5)
    before = quat.rotate(q, bone) / 40.0
    assert abs(quat.angle(aimed, q) - np.arccos(np.clip(before @ unit, -1, 1))) < 1e-4
