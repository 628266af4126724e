"""The caller's axes, units and ground."""

import numpy as np
import pytest

from hobble.core import quat
from hobble.runtime import ProceduralAnimation
from hobble.runtime.caller_targets import MATRICES, Axes
from hobble.runtime.ground import CELL, Heightmap
from tests.runtime.walking import hills, walk


@pytest.mark.parametrize(("handed", "up", "unit"), [("right", "Y", "cm"), ("left", "Z", "m")])
def test_a_heightmap_is_in_the_callers_axes_and_unit(network, handed: str, up: str, unit: str) -> None:
    """A heightmap in the caller's coordinates gives the same ground as the function that it was made from."""
    axes = Axes(handed, up, unit)

    def terrain(first: np.ndarray, second: np.ndarray) -> np.ndarray:
        rise = 50 * np.tanh(first / axes.scale / 40) + 20 * np.tanh(second / axes.scale / 90)
        return rise * axes.scale

    def root(ground) -> np.ndarray:
        target = axes.points_to_caller(np.array([0.5, 0, 2.0]))
        made = walk(ProceduralAnimation(network, axes=axes), 30, target_velocity=target, terrain=ground)
        return made[-1].root / axes.scale

    def sampled(cell: float, centre: tuple[float, float] = (0, 0)) -> np.ndarray:
        along = (np.arange(401) - 200) * cell
        return terrain(along[None, :] + centre[0], along[:, None] + centre[1])

    expected = root(terrain)
    cell, centre = 4.0 * axes.scale, (30 * axes.scale, -50 * axes.scale)
    np.testing.assert_allclose(root(Heightmap(sampled(cell, centre), cell, centre)), expected, atol=0.5)
    np.testing.assert_allclose(root(sampled(CELL * axes.scale)), expected, atol=0.5)
    level = root(np.full((8, 8), 1.0))["XYZ".index(up)]
    assert level == pytest.approx(1 / axes.scale, abs=1e-3)


@pytest.mark.parametrize(("handed", "up"), MATRICES)
def test_motion_in_other_axes_and_units_is_the_same_motion(network, handed: str, up: str) -> None:
    """A walk over hills in the caller's axes equals the walk in Hobble's axes, left and right included."""
    axes = Axes(handed, up, "m")
    vertical = "XYZ".index(up)
    level = [k for k in range(3) if k != vertical]

    def terrain(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        points = np.zeros((len(a), 3))
        points[:, level] = np.stack([a, b], axis=1)
        ours = axes.points_from_caller(points)
        return hills(ours[:, 0], ours[:, 2]) * axes.scale

    native = ProceduralAnimation(network, position=(30, 0, 10), facing=(1, 0, 1))
    at, towards = (
        axes.points_to_caller(np.array([30.0, 0, 10])),
        axes.directions_to_caller(np.array([1.0, 0, 1])),
    )
    theirs = ProceduralAnimation(network, axes=axes, position=at, facing=towards)
    velocity = np.array([0.5, 0, 2.0])
    for k in range(25):
        a = native.next_pose(velocity, (1, 0, 0), terrain=hills)
        target, facing = axes.points_to_caller(velocity), axes.directions_to_caller(np.array([1.0, 0, 0]))
        b = theirs.next_pose(target if k % 2 else target[level], facing, terrain=terrain)
    np.testing.assert_allclose(axes.points_from_caller(b.positions), a.positions, atol=1e-3)
    np.testing.assert_allclose(axes.points_from_caller(b.root), a.root, atol=1e-3)
    assert b.positions[:, vertical].mean() > 0.5 * 93 * axes.scale
    # A rotation takes the same bone to the same place in both conventions: M R v = R' M v.
    bone = np.array([3.0, -2.0, 5.0])
    np.testing.assert_allclose(
        quat.rotate(b.rotations, axes.directions_to_caller(bone)),
        axes.directions_to_caller(quat.rotate(a.rotations, bone)),
        atol=1e-5,
    )


@pytest.mark.parametrize(
    ("engine", "left_up_ahead"),
    [
        (Axes("left", "Y"), [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]),  # Unity
        (Axes("left", "Z"), [[0, -1, 0], [0, 0, 1], [1, 0, 0]]),  # Unreal
        (Axes("right", "Z"), [[1, 0, 0], [0, 0, 1], [0, -1, 0]]),  # Blender
    ],
)
def test_left_and_right_are_correct_in_each_engine(engine: Axes, left_up_ahead: list[list[int]]) -> None:
    """The left hand of a character that faces ahead is on the left."""
    np.testing.assert_array_equal(engine.directions_to_caller(np.eye(3)), left_up_ahead)
