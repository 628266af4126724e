"""The character: what goes into the network, what comes out, and what the caller may do."""

from __future__ import annotations

import copy
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.errors import InputError
from hobble.core.skeleton import forward_kinematics
from hobble.evaluation.motion_measures import foot_slide, largest_turn
from hobble.models.load import load_network
from hobble.runtime import Pose, ProceduralAnimation
from hobble.runtime.axes import MATRICES, Axes
from hobble.runtime.ground import CELL, Heightmap
from hobble.runtime.waypoints import Waypoint

KNEE = "LeftUpLeg-LeftLeg"


def walk(character: ProceduralAnimation, frames: int, **wishes) -> list[Pose]:
    wishes = {"target_velocity": (0.5, 2.0)} | wishes
    return [character.next_pose(**wishes) for _ in range(frames)]


def hills(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    return 8 * np.sin(x / 60) + 5 * np.cos(z / 45)


def test_the_row_is_that_of_the_definition(hurtable) -> None:
    """X computed in numpy from the state, column by column."""
    character = ProceduralAnimation(hurtable)
    walk(character, 90, injury={KNEE: 6.0}, terrain=hills)
    seen = {}
    evaluate = character._predictor.evaluate
    character._predictor.evaluate = lambda *a: (
        seen.update(state=copy.deepcopy(character.state)),
        evaluate(*a),
    )
    character.next_pose((0.5, 2.0), (1, 0), "jog", injury={KNEE: 6.0}, terrain=hills)
    state, layout, x = seen["state"], hurtable.layout, character._controller.x[0]
    now = layout.window
    position, direction = state.position[0], state.direction[0]

    def to_root(v: np.ndarray, frame: int) -> np.ndarray:
        q = quat.between(np.array([direction[frame, 0], 0, direction[frame, 1]]), np.array([0, 0, 1.0]))
        return quat.rotate(q, v)

    def level(v: np.ndarray) -> np.ndarray:
        return np.stack([v[:, 0], np.zeros(len(v)), v[:, 1]], axis=1)

    samples = np.array(layout.offsets) + now
    places = to_root(level(position[samples] - position[now]), now)
    np.testing.assert_allclose(x[layout.x_position], np.concatenate([places[:, 0], places[:, 2]]), atol=1e-4)
    facing = to_root(level(direction[samples]), now)
    np.testing.assert_allclose(x[layout.x_direction], np.concatenate([facing[:, 0], facing[:, 2]]), atol=1e-6)
    np.testing.assert_allclose(x[layout.x_gait], state.gait[0, samples].T.ravel(), atol=1e-6)
    left = 25 * np.stack([direction[samples, 1], -direction[samples, 0]], axis=1)
    heights = np.array([hills(*(position[samples] + side * left).T) for side in (1, 0, -1)])
    mean = heights[1].mean()
    np.testing.assert_allclose(x[layout.x_terrain], (heights - mean).ravel(), atol=1e-4)
    before = np.array([position[now - 1, 0], mean, position[now - 1, 1]])
    joints = to_root(state.joint_position[0] - before, now - 1)
    np.testing.assert_allclose(x[layout.x_joint_position], joints.ravel(), atol=1e-4)
    velocities = to_root(state.joint_velocity[0], now - 1)
    np.testing.assert_allclose(x[layout.x_joint_velocity], velocities.ravel(), atol=1e-5)
    assert x[layout.x_channel("injury")][2] == 6.0
    assert x[layout.x_channel("injury")].sum() == 6.0


def test_the_pose_is_that_of_the_prediction(network) -> None:
    character = ProceduralAnimation(network, foot_locking=False)
    walk(character, 50, terrain=hills)
    old = character.state.joint_position[0].copy()
    pose = character.next_pose((0.5, 2.0), terrain=hills)
    y, layout = character._controller.y[0].astype(float), network.layout
    turn = quat.yaw(pose.yaw)

    def joints(block: slice) -> np.ndarray:
        return y[block].reshape(-1, 3)

    predicted = quat.rotate(turn, joints(layout.y_joint_position)) + pose.root
    carried = old + quat.rotate(turn, joints(layout.y_joint_velocity))
    np.testing.assert_allclose(character.state.joint_position[0], (predicted + carried) / 2, atol=1e-4)
    rotations = quat.mul(turn, quat.exp(joints(layout.y_joint_rotation)))
    np.testing.assert_allclose(character.state.joint_rotation[0], rotations, atol=1e-6)
    legs, *_ = character._controller._legs
    others = np.setdiff1d(np.arange(layout.joints), [*legs.ravel(), 4, 5, 9, 10])
    np.testing.assert_array_equal(pose.positions[others], character.state.joint_position[0][others])
    assert pose.positions.shape == (31, 3)
    assert pose.rotations.shape == (31, 4)


def test_no_joint_turns_faster_than_a_joint_can(steady) -> None:
    """After a jump of the prediction by half a turn, the pose follows at 25 degrees a frame."""
    character = ProceduralAnimation(steady)
    evaluate, hand = character._predictor.evaluate, steady.skeleton.role("left_wrist")
    first = steady.layout.y_joint_rotation.start + 3 * hand
    angles = iter([10.0, 30.0, *[175.0] * 9, *[-175.0] * 3])

    def jumping(z, phase, out) -> None:
        evaluate(z, phase, out)
        out[:, first : first + 3] = [0.0, 0.0, np.radians(next(angles)) / 2]

    character._predictor.evaluate = jumping
    seen = []
    for _ in range(14):
        q = character.next_pose((0, 1.5)).rotations[hand]
        seen.append(np.degrees(2 * np.arctan2(q[3], q[0])) % 360)
    expected = [10, 30, 55, 80, 105, 130, 155, 175, 175, 175, 175, 185, 185, 185]
    np.testing.assert_allclose(seen, expected, atol=1e-3)


def test_changing_a_pose_does_not_change_the_state(network) -> None:
    left, right = ProceduralAnimation(network), ProceduralAnimation(network)
    for _ in range(40):
        pose, untouched = left.next_pose((1, 2)), right.next_pose((1, 2))
        np.testing.assert_array_equal(pose.positions, untouched.positions)
        for array in (pose.positions, pose.rotations, pose.contacts, pose.root, *pose.channels.values()):
            array[...] = 1e6


@pytest.mark.parametrize("count", [2, 5])
def test_many_characters_equal_single_characters(hurtable, count: int) -> None:
    rng = np.random.default_rng(3)
    velocity, facing = rng.normal(0, 2, (count, 2)), rng.normal(size=(count, 2))
    gaits = ["walk", "jog", "crouch", "walk", "jog"][:count]
    severity = rng.uniform(0, 10, count)
    start = rng.normal(0, 100, (count, 3))
    crowd = ProceduralAnimation(hurtable, characters=count, position=start)
    alone = [ProceduralAnimation(hurtable, position=start[k]) for k in range(count)]
    for _ in range(45):
        many = crowd.next_pose(velocity, facing, gaits, injury={KNEE: severity}, terrain=hills)
        for k, one in enumerate(alone):
            single = one.next_pose(
                velocity[k], facing[k], gaits[k], injury={KNEE: severity[k]}, terrain=hills
            )
    assert many.positions.shape == (count, 31, 3)
    for k in range(count):
        one = alone[k].next_pose(velocity[k], facing[k], gaits[k], injury={KNEE: severity[k]}, terrain=hills)
    many = crowd.next_pose(velocity, facing, gaits, injury={KNEE: severity}, terrain=hills)
    np.testing.assert_allclose(many.positions[-1], one.positions, atol=0.02)
    np.testing.assert_allclose(many.phase[-1], one.phase, atol=1e-4)
    assert single.channels["injury"].max() == pytest.approx(min(severity[-1], 7.5))


def test_the_same_calls_give_the_same_motion(network) -> None:
    first = ProceduralAnimation(network)
    motion = [p.positions for p in walk(first, 30)]
    first.reset()
    np.testing.assert_array_equal(motion, [p.positions for p in walk(first, 30)])


def test_reset_places_the_figure(steady) -> None:
    character = ProceduralAnimation(steady, position=(100, 0, -50), facing=(1, 0, 0))
    pose = character.next_pose((0, 0))
    np.testing.assert_allclose(pose.root, [100, 0, -50])
    assert pose.yaw == pytest.approx(np.pi / 2)
    left, right = (steady.skeleton.role(f"{side}_hip") for side in ("left", "right"))
    # Facing +X, the left is -Z.
    assert pose.positions[left, 2] < -50 < pose.positions[right, 2]


def test_gaits(network) -> None:
    character = ProceduralAnimation(network)

    def shares(velocity, gait=None) -> dict[str, float]:
        character.next_pose(velocity, gait=gait)
        wish = dict(zip(network.gaits, character._wish_gait[0], strict=True))
        return {name: share for name, share in wish.items() if share}

    assert shares((0, 0.05), "jog") == {"stand": 1}
    assert shares((0, 0.05), "crouch") == {"stand": 1, "crouch": 1}
    assert shares((0, 2.5)) == {"walk": 1}
    assert shares((0, 7.0)) == {"jog": 1}
    assert shares((0, 7.0), "crouch") == {"crouch": 1}
    assert shares((0, 2.5), np.array([0, 0.5, 0.5, 0, 0, 0])) == {"walk": 0.5, "jog": 0.5}
    for listed in ([0, 0, 1, 0, 0, 0], (0, 0, 1.0, 0, 0, 0), np.eye(6, dtype=int)[2], [[0, 0, 1, 0, 0, 0]]):
        assert shares((0, 2.5), listed) == {"jog": 1}
    with pytest.raises(KeyError, match=r"no gait 'moonwalk'; did you mean walk\?"):
        character.next_pose((0, 1), gait="moonwalk")
    with pytest.raises(KeyError, match="no gait 'swim': there are stand, walk, jog"):
        character.next_pose((0, 1), gait="swim")


def test_gait_blends_slowly_into_the_future(network) -> None:
    character = ProceduralAnimation(network)
    middle = network.layout.window
    for n in range(1, 20):
        character.next_pose((0, 2.5), gait="walk")
        walk_share = character.state.gait[0, middle, 1]
        assert walk_share == pytest.approx(1 - 0.9**n)
        np.testing.assert_allclose(character.state.gait[0, middle:, 1], walk_share)


def test_severities_change_at_their_rate_and_are_scaled(hurtable) -> None:
    character = ProceduralAnimation(hurtable, rates={"injury": 5.0}, scales={"injury": 2.0})
    index = hurtable.channels["injury"].index(KNEE)
    on = [p.channels["injury"][index] for p in walk(character, 120, injury={KNEE: 10})]
    np.testing.assert_allclose(on[:60], 5.0 / 60 * np.arange(1, 61))
    assert on[-1] == pytest.approx(5.0)
    kept = walk(character, 5)[-1]
    assert kept.channels["injury"][index] == pytest.approx(5.0)
    assert kept.channels["injury"].sum() == pytest.approx(5.0)
    healed = walk(character, 120, injury={})[-1]
    assert healed.channels["injury"].sum() == 0


@pytest.mark.parametrize("injury", [{"LeftUpLeg-LeftLeg": 11}, {KNEE: -0.1}, {KNEE: np.nan}])
def test_a_severity_out_of_range(hurtable, injury) -> None:
    with pytest.raises(ValueError, match=r"the severity of LeftUpLeg-LeftLeg is .* from 0 to 10"):
        ProceduralAnimation(hurtable).next_pose((0, 1), injury=injury)


def test_invalid_wishes_are_refused(network) -> None:
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


def test_the_ground_may_be_one_height(network) -> None:
    level, flat = ProceduralAnimation(network), ProceduralAnimation(network)
    for _ in range(9):
        a, b = level.next_pose((0, 2), terrain=lambda x, z: 30.0), flat.next_pose((0, 2))
    np.testing.assert_allclose(a.positions - a.root, b.positions - b.root, atol=15)
    assert a.root[1] == 30.0


def test_a_zero_facing_looks_where_the_character_goes(network) -> None:
    crowd, one = ProceduralAnimation(network, characters=2), ProceduralAnimation(network)
    for _ in range(20):
        many = crowd.next_pose((1, 2), [(0, 0), (1, 0)])
        single = one.next_pose((1, 2))
    np.testing.assert_array_equal(many.positions[0], single.positions)
    assert np.abs(many.positions[1] - single.positions).max() > 0.1


def test_unknown_links_are_named(hurtable, network) -> None:
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


def test_severities_of_another_shape(hurtable, network) -> None:
    crowd = ProceduralAnimation(hurtable, characters=3)
    for injury in (np.ones((3, 30)), np.ones(30), {KNEE: [1, 2, 3]}, {KNEE: 4}, {}):
        crowd.next_pose((0, 1), injury=injury)
    with pytest.raises(ValueError, match=r"injury has to have shape \(30,\) or \(3, 30\), not \(29,\)"):
        crowd.next_pose((0, 1), injury=np.ones(29))
    with pytest.raises(ValueError, match=rf"{KNEE} has to be one severity or 3, not of shape \(2,\)"):
        crowd.next_pose((0, 1), injury={KNEE: [1, 2]})
    with pytest.raises(
        ValueError, match="30 numbers given for injury, but this network has no input for injury"
    ):
        ProceduralAnimation(network).next_pose((0, 1), injury=np.ones(30))


def test_terrain_as_function_heightmap_and_array(network) -> None:
    cell = 4.0
    grid = (np.arange(401) - 200) * cell
    heights = hills(grid[None, :], grid[:, None])
    coarse = Heightmap(heights, cell)
    motions = [
        [p.positions for p in walk(ProceduralAnimation(network, steering=1.0), 40, terrain=terrain)]
        for terrain in (hills, coarse, None)
    ]
    np.testing.assert_allclose(motions[0], motions[1], atol=0.2)
    assert np.abs(np.subtract(motions[0], motions[2])).max() > 2
    one, other = ProceduralAnimation(network), ProceduralAnimation(network)
    np.testing.assert_array_equal(
        walk(one, 9, terrain=heights)[-1].positions, walk(other, 9, terrain=Heightmap(heights))[-1].positions
    )
    with pytest.raises(TypeError, match="not str"):
        ProceduralAnimation(network).next_pose((0, 1), terrain="hill")
    with pytest.raises(ValueError, match="2 x 2"):
        Heightmap(np.zeros((1, 5)))


@pytest.mark.parametrize("unit", ["cm", "m"])
@pytest.mark.parametrize(("handed", "up"), MATRICES)
def test_a_heightmap_is_in_the_callers_axes_and_unit(network, handed: str, up: str, unit: str) -> None:
    """A heightmap in the caller's coordinates gives the same ground as the function that it was made from."""
    axes = Axes(handed, up, unit)

    def terrain(first: np.ndarray, second: np.ndarray) -> np.ndarray:
        rise = 50 * np.tanh(first / axes.scale / 40) + 20 * np.tanh(second / axes.scale / 90)
        return rise * axes.scale

    def root(ground) -> np.ndarray:
        wish = axes.points_out(np.array([0.5, 0, 2.0]))
        made = walk(ProceduralAnimation(network, axes=axes), 30, target_velocity=wish, terrain=ground)
        return made[-1].root / axes.scale

    def sampled(cell: float, centre: tuple[float, float] = (0, 0)) -> np.ndarray:
        along = (np.arange(401) - 200) * cell
        return terrain(along[None, :] + centre[0], along[:, None] + centre[1])

    asked = root(terrain)
    cell, centre = 4.0 * axes.scale, (30 * axes.scale, -50 * axes.scale)
    np.testing.assert_allclose(root(Heightmap(sampled(cell, centre), cell, centre)), asked, atol=0.5)
    np.testing.assert_allclose(root(sampled(CELL * axes.scale)), asked, atol=0.5)
    level = root(np.full((8, 8), 1.0))["XYZ".index(up)]
    assert level == pytest.approx(1 / axes.scale, abs=1e-3)


def test_heightmap_is_bilinear_and_goes_on_outside() -> None:
    ground = Heightmap(np.array([[0.0, 10.0], [20.0, 50.0]]), cell=2.0, centre=(5.0, 7.0))
    x, z = np.array([4.0, 6.0, 4.0, 6.0, 5.0, 99.0]), np.array([6.0, 6.0, 8.0, 8.0, 7.0, -99.0])
    np.testing.assert_allclose(ground(x, z), [0, 10, 20, 50, 20, 10])


@pytest.mark.parametrize("unit", ["cm", "m"])
@pytest.mark.parametrize(("handed", "up"), MATRICES)
def test_the_callers_axes(network, handed: str, up: str, unit: str) -> None:
    """A walk over hills in the caller's axes equals the walk in Hobble's axes, left and right included."""
    axes = Axes(handed, up, unit)
    vertical = "XYZ".index(up)
    level = [k for k in range(3) if k != vertical]

    def terrain(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        points = np.zeros((len(a), 3))
        points[:, level] = np.stack([a, b], axis=1)
        ours = axes.points_in(points)
        return hills(ours[:, 0], ours[:, 2]) * axes.scale

    native = ProceduralAnimation(network, position=(30, 0, 10), facing=(1, 0, 1))
    theirs = ProceduralAnimation(
        network,
        axes=axes,
        position=axes.points_out(np.array([30.0, 0, 10])),
        facing=axes.directions_out(np.array([1.0, 0, 1])),
    )
    velocity = np.array([0.5, 0, 2.0])
    for k in range(25):
        a = native.next_pose(velocity, (1, 0, 0), terrain=hills)
        wish = axes.points_out(velocity)
        b = theirs.next_pose(
            wish if k % 2 else wish[level], axes.directions_out(np.array([1.0, 0, 0])), terrain=terrain
        )
    np.testing.assert_allclose(axes.points_in(b.positions), a.positions, atol=1e-3)
    np.testing.assert_allclose(axes.points_in(b.root), a.root, atol=1e-3)
    assert b.positions[:, vertical].mean() > 0.5 * 93 * axes.scale
    # A rotation takes the same bone to the same place in both conventions: M R v = R' M v.
    bone = np.array([3.0, -2.0, 5.0])
    np.testing.assert_allclose(
        quat.rotate(b.rotations, axes.directions_out(bone)),
        axes.directions_out(quat.rotate(a.rotations, bone)),
        atol=1e-5,
    )


@pytest.mark.parametrize("unit", ["cm", "m"])
@pytest.mark.parametrize(("handed", "up"), MATRICES)
def test_an_asymmetric_pose_is_the_same_in_every_convention(
    holden31, handed: str, up: str, unit: str
) -> None:
    """Left arm up, right knee bent: the caller's own bones, turned by the rotations it gets, end where it is
    told that the joints are, and the left hand is on the caller's left."""
    local = np.tile([1.0, 0, 0, 0], (1, 31, 1))
    for joint, axis, angle in (("left_shoulder", [0.3, 0, 1.0], 1.1), ("right_hip", [1.0, 0.2, 0], -0.7)):
        axis = np.array(axis) / np.linalg.norm(axis)
        local[0, holden31.role(joint)] = quat.from_axis_angle(axis, angle)
    local[0, 0] = quat.from_axis_angle([0, 1.0, 0], 0.4)
    ours, placed = forward_kinematics(holden31, local, np.array([[10.0, 95, 20]]))
    axes = Axes(handed, up, unit)
    rotations, positions = axes.rotations_out(ours[0]), axes.points_out(placed[0])
    bones = axes.points_out(holden31.offsets)
    for joint, parent in enumerate(holden31.parents):
        if parent >= 0:
            end = positions[parent] + quat.rotate(rotations[parent], bones[joint])
            np.testing.assert_allclose(end, positions[joint], atol=1e-9)
    hand = positions[holden31.role("left_wrist")] - positions[0]
    across = quat.rotate(rotations[0], axes.directions_out(np.array([1.0, 0, 0])))
    assert hand @ across > 0.2 * np.linalg.norm(hand)
    assert hand["XYZ".index(up)] > 60 * axes.scale
    np.testing.assert_allclose(axes.points_in(positions), placed[0], atol=1e-9)


def test_sides_in_unity_and_unreal() -> None:
    """The left hand of a character that faces ahead is on the left in each engine's axes."""
    left, up, ahead = np.eye(3)
    unity, unreal, blender = Axes("left", "Y"), Axes("left", "Z"), Axes("right", "Z")
    np.testing.assert_array_equal(
        unity.directions_out(np.array([left, up, ahead])), [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]
    )
    np.testing.assert_array_equal(
        unreal.directions_out(np.array([left, up, ahead])), [[0, -1, 0], [0, 0, 1], [1, 0, 0]]
    )
    np.testing.assert_array_equal(
        blender.directions_out(np.array([left, up, ahead])), [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    )
    with pytest.raises(ValueError, match="handed is right or left"):
        Axes("both")


def test_what_a_game_loads(root: Path) -> None:
    """The runtime imports neither torch nor anything that only the workflow or an export needs."""
    heavy = "{'torch', 'snakemake', 'pydantic', 'onnx', 'onnxruntime', 'matplotlib', 'plotly'}"
    code = f"import sys, hobble.runtime; sys.exit({heavy} & set(sys.modules) or 0)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=root)
    assert done.stderr == ""
    assert done.returncode == 0


def test_a_network_without_skeleton_is_refused(tmp_path: Path, network) -> None:
    with pytest.raises(ValueError, match="skeleton"):
        ProceduralAnimation(replace(network, skeleton=None))
    with pytest.raises(InputError, match="no such file"):
        ProceduralAnimation.load(tmp_path / "missing.npz")


@pytest.mark.shared
@pytest.mark.parametrize("mode", ["constant", "linear", "cubic"])
def test_the_released_network_does_not_fall_apart(shared: Path, holden31, mode: str) -> None:
    """A minute of walking, jogging, crouching, strafing, stopping and turning on flat ground."""
    network = load_network(shared / "reference" / "pfnn_release_network.npz", holden31)
    character = ProceduralAnimation(network, mode=mode)
    poses = []
    script = [
        ((0, 2.5), None, "walk"), ((6, 3), None, "jog"), ((0, 2), None, "crouch"), ((2.5, 0), (0, 1), "walk"),
        ((-1.5, -1.5), (0, 1), "walk"), ((0, 0), None, "walk"), ((0, 0), (-1, 0), "walk"), ((0, -2.5), None,
        "walk"),
    ]  # fmt: skip
    for velocity, facing, gait in script:
        poses += [character.next_pose(velocity, facing, gait) for _ in range(450)]
    positions = np.array([p.positions for p in poses])
    assert np.all(np.isfinite(positions))
    hips = positions[:, 0, 1]
    assert hips.min() > 60
    assert hips.max() < 110
    assert largest_turn(np.array([p.rotations for p in poses])) < 60
    assert foot_slide(positions[:, [5, 10]], np.array([p.contacts for p in poses])).mean() < 2
    # It goes where it is sent: the last walk leads toward -Z, the stop stands still.
    root = np.array([p.root for p in poses])
    assert root[-1, 2] - root[-200, 2] < -200
    stop = root[5 * 450 + 200 : 6 * 450]
    assert np.abs(stop - stop[0]).max() < 3
    # Its turn in place ends facing -X, which a wrong sign of the turn would never reach.
    assert abs(np.sin(poses[7 * 450 - 1].yaw) + 1) < 0.05


@pytest.mark.shared
def test_the_released_network_keeps_its_feet_on_hills(shared: Path, holden31) -> None:
    """A quarter of a minute in a curve over rolling ground: soles neither sink nor float nor slide."""
    network = load_network(shared / "reference" / "pfnn_release_network.npz", holden31)
    character = ProceduralAnimation(network)
    legs, _, soles = character._controller._legs
    sole = np.tile(soles, 2)

    def rolling(x: np.ndarray, z: np.ndarray) -> np.ndarray:
        return 14 * np.sin(x / 170) * np.cos(z / 140) + 8 * np.sin((x + z) / 260)

    above, contacts, toes = [], [], []
    for frame in range(900):
        turn = 0.004 * frame
        pose = character.next_pose((2.5 * np.sin(turn), 2.5 * np.cos(turn)), gait="walk", terrain=rolling)
        feet = pose.positions[legs[:, 2:]].reshape(4, 3)
        above.append(feet[:, 1] - rolling(feet[:, 0], feet[:, 2]) - sole)
        contacts.append(pose.contacts)
        toes.append(pose.positions[legs[:, 3]])
    standing = np.array(contacts) > 0.5
    assert np.min(above) > -1
    assert np.median(np.array(above)[standing]) < 1.5
    assert np.percentile(np.array(above)[standing], 95) < 5
    assert foot_slide(np.array(toes), np.array(contacts)).mean() < 2


def same(a, b) -> bool:
    """Whether two states are equal, bit for bit."""
    return all(np.array_equal(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))


@pytest.mark.parametrize(
    ("wishes", "message"),
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
def test_impossible_wishes_are_refused_and_change_nothing(hurtable, wishes: dict, message: str) -> None:
    character = ProceduralAnimation(hurtable)
    walk(character, 5, injury={KNEE: 3.0})
    before = copy.deepcopy(character.state)
    with pytest.raises(ValueError, match=message):
        character.next_pose(**{"target_velocity": (0.5, 2.0), "injury": {KNEE: 9.0}, **wishes})
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


def test_a_character_starts_on_the_ground_at_any_height(steady) -> None:
    low, high = ProceduralAnimation(steady), ProceduralAnimation(steady)
    for _ in range(3):
        a = low.next_pose((0, 1.5)).positions
        b = high.next_pose((0, 1.5), terrain=lambda x, z: 500.0).positions
        np.testing.assert_allclose(b - a, np.broadcast_to([0, 500.0, 0], a.shape), atol=1e-3)
