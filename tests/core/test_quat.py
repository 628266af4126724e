"""Rotations compared with SciPy's, and properties that hold for all rotations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation, Slerp

from hobble.core import quat

FEW = settings(max_examples=40, deadline=None)
vectors = arrays(float, 3, elements=st.floats(-100, 100, allow_subnormal=False))
numbers = st.floats(-1, 1, allow_subnormal=False)
rotations = arrays(float, 4, elements=numbers).filter(lambda q: np.linalg.norm(q) > 0.1).map(quat.normalize)


def scipy(q):
    return Rotation.from_quat(q, scalar_first=True)


def same(a, b, tolerance=1e-7):
    """Whether two quaternions are the same rotation, with either sign."""
    return np.all(quat.angle(a, b) < tolerance)


@FEW
@given(rotations, rotations, vectors)
def test_product_inverse_and_rotation_agree_with_scipy(a, b, v):
    assert same(quat.mul(a, b), (scipy(a) * scipy(b)).as_quat(scalar_first=True))
    assert same(quat.inv(a), scipy(a).inv().as_quat(scalar_first=True))
    np.testing.assert_allclose(quat.rotate(a, v), scipy(a).apply(v), atol=1e-10)
    np.testing.assert_allclose(quat.rotate(quat.mul(a, b), v), quat.rotate(a, quat.rotate(b, v)), atol=1e-10)


@FEW
@given(rotations)
def test_matrices_agree_with_scipy_and_round_trip(q):
    matrix = quat.to_matrix(q)
    np.testing.assert_allclose(matrix, scipy(q).as_matrix(), atol=1e-12)
    assert same(quat.from_matrix(matrix), q)
    assert quat.from_matrix(matrix)[0] >= 0


@pytest.mark.parametrize("order", ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"])
@FEW
@given(arrays(float, (3,), elements=st.floats(-3.1, 3.1)))
def test_euler_angles_are_intrinsic_and_round_trip(order, angles):
    q = quat.from_euler(angles, order)
    assert same(q, Rotation.from_euler(order, angles).as_quat(scalar_first=True))
    assert same(quat.from_euler(quat.to_euler(q, order), order), q, 1e-5)
    assert abs(quat.to_euler(q, order)[1]) <= np.pi / 2 + 1e-9


@pytest.mark.parametrize("order", ["ZYX", "XYZ", "YZX"])
@pytest.mark.filterwarnings("error")
def test_gimbal_lock_keeps_the_rotation(order: str) -> None:
    q = quat.from_euler(np.array([0.4, np.pi / 2, -1.1]), order)
    assert same(quat.from_euler(quat.to_euler(q, order), order), q, 1e-5)


@FEW
@given(rotations)
def test_log_is_half_the_angle_and_exp_its_inverse(q):
    v = quat.log(q)
    assert np.linalg.norm(v) <= np.pi / 2 + 1e-9
    assert same(quat.exp(v), q)
    if abs(q[0]) > 1e-6:  # a rotation by 180 degrees has two possible axes
        np.testing.assert_allclose(2 * v, scipy(quat.positive(q)).as_rotvec(), atol=1e-7)


@FEW
@given(vectors, vectors)
def test_between_is_the_shortest_rotation(a, b):
    if min(np.linalg.norm(a), np.linalg.norm(b)) < 1e-3:
        return
    q = quat.between(a, b)
    unit = b / np.linalg.norm(b)
    np.testing.assert_allclose(quat.rotate(q, a / np.linalg.norm(a)), unit, atol=1e-5)
    cosine = np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1)
    assert quat.angle(q, quat.IDENTITY) == pytest.approx(np.arccos(cosine), abs=1e-4)


def test_between_opposite_directions_is_half_a_turn():
    for direction in np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0], [0.6, 0, -0.8]]):
        q = quat.between(direction, -direction)
        np.testing.assert_allclose(quat.rotate(q, direction), -direction, atol=1e-9)
        assert quat.angle(q, quat.IDENTITY) == pytest.approx(np.pi)


@FEW
@given(rotations, rotations, st.floats(0, 1))
def test_slerp_agrees_with_scipy(a, b, t):
    if quat.angle(a, b) > 3.1:
        return
    expected = Slerp([0, 1], scipy(np.stack([a, b])))(t).as_quat(scalar_first=True)
    assert same(quat.slerp(a, b, t), expected, 1e-6)
