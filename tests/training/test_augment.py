"""Changed batches: motion at other paces, poses moved towards other poses, and errors as in a roll-out."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

from hobble.core.quat import Array
from hobble.database.reader import Block, Database
from hobble.database.write import write_database
from hobble.measures.accuracy_run import RollOutInputs
from hobble.rows.clip_rows import ClipRows
from hobble.training.augment import BEYOND, NEAR, RISE, OtherPaces, OtherPoses, RollOut, VersionPoses, x_pose
from tests.measures.made_up import roll_out

from .conftest import change, clip_rows

CPU = torch.device("cpu")

# Motion that is played at other paces along smooth paths.

WALKERS, SPEED, SLOPE, FACTOR = 400, 1.5, 0.2, 1.5  # SPEED: cm a frame, SLOPE: cm of height a sample


def walkers(data: Database) -> tuple[Any, Any]:
    """X and Y in raw units of figures that walk straight on at SPEED on level ground, in float64."""
    layout = data.layout
    x, y = torch.zeros(WALKERS, layout.x_size).double(), torch.zeros(WALKERS, layout.y_size).double()
    frames = torch.tensor(list(layout.offsets)).double()
    n = layout.samples
    x[:, layout.x_position][:, n:] = SPEED * frames
    x[:, layout.x_direction][:, n:] = 1.0
    y[:, layout.y_position][:, layout.future :] = SPEED * frames[layout.future :]
    y[:, layout.y_direction][:, layout.future :] = 1.0
    y[:, layout.y_root_velocity.stop - 1] = SPEED
    y[:, layout.y_phase_change] = 0.02
    for block in (layout.x_joint_velocity, layout.y_joint_velocity):
        (x if block is layout.x_joint_velocity else y)[:, block] = 3.0
    x[:, layout.x_channel("injury")] = 7.0
    return x, y


def played(data: Database, x: Any, y: Any, factor: float = FACTOR) -> tuple[Any, Any]:
    """Raw X and Y after the first batch."""
    s = data.statistics
    std, mean = (
        torch.from_numpy(np.concatenate(pair)).double() for pair in ((s.x_std, s.y_std), (s.x_mean, s.y_mean))
    )
    both = (torch.cat([x, y], dim=1) - mean) / std
    inputs, outputs = (part.float().contiguous() for part in both.split([x.shape[1], y.shape[1]], dim=1))
    change(OtherPaces(data, factor, range(len(x)), CPU), inputs, y=outputs)
    both = torch.cat([inputs, outputs], dim=1).double() * std + mean
    return both.split([x.shape[1], y.shape[1]], dim=1)


def paces(data: Database, y: Any) -> Any:
    return y[:, data.layout.y_root_velocity.stop - 1] / SPEED


def test_a_straight_walk_stays_one_at_paces_spread_evenly(data: Database) -> None:
    layout, n = data.layout, data.layout.samples
    x, y = played(data, *walkers(data))
    pace = paces(data, y)
    even = np.sort(np.log(pace.numpy()) / np.log(FACTOR))
    np.testing.assert_allclose(even, np.linspace(-1, 1, WALKERS), atol=0.03)
    path = x[:, layout.x_position]
    assert path[:, :n].abs().max() < 1e-3
    # The end of the window says how the pace changes; everything between follows.
    time = torch.tensor(list(layout.offsets)).double() / layout.window
    ahead = path[:, n:] / (SPEED * layout.window)
    rise = 1 - ahead[:, 0] / -pace
    np.testing.assert_allclose(ahead, pace[:, None] * time * (1 + rise[:, None] * time), atol=1e-3)
    np.testing.assert_allclose(np.sort(rise), np.linspace(-RISE / 2, RISE / 2, WALKERS), atol=0.01)
    assert abs(np.corrcoef(rise, pace)[0, 1]) < 0.1
    np.testing.assert_allclose(
        y[:, layout.y_position][:, layout.future :], path[:, n + layout.future :], atol=0.01
    )
    np.testing.assert_allclose(x[:, layout.x_direction][:, n:], 1.0, atol=1e-3)
    np.testing.assert_allclose(y[:, layout.y_phase_change][:, 0], 0.02 * pace, atol=1e-4)
    for table, block in ((x, layout.x_joint_velocity), (y, layout.y_joint_velocity)):
        np.testing.assert_allclose(
            table[:, block], (3.0 * pace)[:, None].expand(-1, 3 * layout.joints), atol=1e-3
        )
    np.testing.assert_allclose(x[:, layout.x_channel("injury")], 7.0, atol=1e-5)


def test_the_pose_before_is_nearer_at_a_slower_pace(data: Database) -> None:
    layout = data.layout
    x, y = walkers(data)
    x[:, layout.x_joint_position], y[:, layout.y_joint_position] = 10.0, 14.0
    x, y = played(data, x, y)
    expected = 14.0 - 4.0 * paces(data, y)
    found = x[:, layout.x_joint_position]
    np.testing.assert_allclose(found, expected[:, None].expand_as(found), atol=0.01)
    np.testing.assert_allclose(y[:, layout.y_joint_position], 14.0, atol=0.01)


def test_joints_keep_their_heights_above_a_slope(data: Database) -> None:
    layout, n = data.layout, data.layout.samples
    x, y = walkers(data)
    slope = SLOPE * (torch.arange(n).double() - (n - 1) / 2)
    x[:, layout.x_terrain] = slope.repeat(3)
    x[:, layout.x_joint_position], y[:, layout.y_joint_position] = 10.0, 10.0
    x, y = played(data, x, y)
    ground = x[:, layout.x_terrain][:, n : 2 * n]
    np.testing.assert_allclose(ground.mean(dim=1), 0.0, atol=1e-4)
    here = ground[:, n // 2]
    for table, block in ((x, layout.x_joint_position), (y, layout.y_joint_position)):
        joints = table[:, block].unflatten(1, (-1, 3))
        above = joints[..., 1] - here[:, None]
        np.testing.assert_allclose(above, 10.0 - float(slope[n // 2]), atol=0.01)
        np.testing.assert_allclose(joints[..., ::2], 10.0, atol=0.01)
    steep = (ground[:, n // 2 + 1] - here) / SLOPE
    assert steep.min() < 0.75, "a slower walker sees the same slope closer"
    assert steep.max() > 1.4


def test_sway_shrinks_by_shares_spread_evenly_and_a_curve_stays(data: Database) -> None:
    layout, n = data.layout, data.layout.samples
    x, y = walkers(data)
    time = torch.tensor(list(layout.offsets)).double() / layout.window
    sway = torch.tensor([1.0, -1.0]).double().repeat(n // 2) * (time != 0)
    powers = torch.stack([time, time**2], dim=1)
    sway = sway - powers @ (torch.linalg.pinv(powers) @ sway)
    x[:, layout.x_position][:, :n] = 30 * time**2 + 4 * sway
    x, _ = played(data, x, y, 1 + 1e-9)
    # Where the pace hardly changes, only the smoothing is left.
    rise = 1 + x[:, layout.x_position][:, n] / (SPEED * layout.window)
    rest = (x[:, layout.x_position][:, :n] - 30 * time**2) @ sway / (4 * sway @ sway)
    rest = rest[rise.abs() < 0.02]
    assert len(rest) > 20
    np.testing.assert_allclose(np.sort(rest), np.linspace(0, 1, len(rest)), atol=0.15)


# Input poses that are moved towards those of clips with other channel values.

ROWS = 200


def batch(
    data: Database, pose: float, phase: float, jog: float = 0.0, rows: int = ROWS, hurt: float | None = None
) -> Any:
    """Rows with one value in every column of the pose, a share of a jog, and a value of the channel."""
    layout = data.layout
    x = torch.full((rows, layout.x_size), 7.0)
    x[:, x_pose(layout.blocks("x"))] = pose
    jogs = layout.x_gait.start + 2 * layout.samples
    x[:, jogs : jogs + layout.samples] = jog / float(data.statistics.x_std[jogs])
    x[:, layout.x_channel("injury")] = pose if hurt is None else hurt
    return x, torch.full((rows,), phase)


def test_a_share_of_the_rows_moves_evenly_towards_the_pose_before(data: Database) -> None:
    others, columns = OtherPoses(data, 0.4, range(ROWS), CPU), np.r_[x_pose(data.layout.blocks("x"))]
    others.begin_section()
    first, p = batch(data, 0.0, 0.51)
    change(others, first, p)
    assert torch.equal(first, batch(data, 0.0, 0.51)[0]), "no place has another pose yet"
    x, p = batch(data, 1.0, 0.52)
    change(others, x, p)
    part = 1 - x[:, columns[0]].numpy()
    assert torch.equal(x[:, columns], x[:, columns[:1]].expand(-1, len(columns)))
    rest = [column for column in range(data.layout.x_size) if column not in columns]
    assert torch.equal(x[:, rest], batch(data, 1.0, 0.52)[0][:, rest])
    assert np.mean(part == 0) == pytest.approx(0.6, abs=0.02)
    moved = np.sort(part[part != 0])
    np.testing.assert_allclose(moved, np.linspace(-BEYOND, 1, len(moved)), atol=0.03)
    again, p = batch(data, 2.0, 0.52)
    change(others, again, p)
    assert again[:, columns].min() == pytest.approx(1.0, abs=0.05), (
        "towards the row's own pose, not the moved"
    )
    assert not torch.equal(again[:, columns[0]] < 2, x[:, columns[0]] < 1), "other rows in each batch"


@pytest.mark.parametrize(
    ("phase", "jog", "hurt"), [(0.53 + NEAR, 0.0, 1.0), (0.52, 1.0, 1.0), (0.52, 0.0, 0.0)]
)
def test_no_pose_of_another_phase_or_gait_or_of_the_same_values(
    data: Database, phase: float, jog: float, hurt: float
) -> None:
    others = OtherPoses(data, 1.0, range(ROWS), CPU)
    others.begin_section()
    change(others, *batch(data, 0.0, 0.52))
    x, p = batch(data, 1.0, phase, jog, hurt=hurt)
    change(others, x, p)
    assert torch.equal(x, batch(data, 1.0, phase, jog, hurt=hurt)[0])


def test_the_nearest_phase_is_taken_also_over_the_end_of_the_cycle(data: Database) -> None:
    others = OtherPoses(data, 1.0, range(ROWS), CPU)
    others.begin_section()
    for pose, phase in ((10.0, 0.04), (20.0, 0.99), (30.0, 0.96)):
        change(others, *batch(data, pose, phase))
    x, p = batch(data, 0.0, 0.01)
    change(others, x, p)
    assert float(x[:, x_pose(data.layout.blocks("x"))].max()) == pytest.approx(20.0, rel=0.02)


# Input poses that are moved between a clip and its hurt versions.

SOURCES = {"walk_hurt1": "walk", "walk_mirror_hurt1": "walk_mirror"}


def rows_of(name: str, pose: float, rows: int = 120, seed: int = 1, way: float = 0.0) -> ClipRows:
    """Rows of three cycles with one value in every column of the pose, on level ground."""
    made = clip_rows(name, rows, 1, seed)
    x = made.x.copy()
    x[:, x_pose(made.layout.blocks("x"))] = (
        pose  # joints come before the terrain, so the columns are the same with it
    )
    for block in (made.layout.x_direction, made.layout.x_gait):
        x[:, block] = way
    return replace(made, x=x, mean=0 * made.mean)


def database(path: Path, clips: Mapping[str, ClipRows], **options: Any) -> Database:
    splits = dict.fromkeys(clips, "train")
    write_database(path, clips, splits, channels=["injury"], sources=SOURCES, joint_weight=0.1, **options)
    return Database.open(path, 64)


@pytest.fixture
def healthy_and_hurt(tmp_path: Path) -> Database:
    clips = {
        "walk": rows_of("walk", 1.0),
        "walk_hurt1": rows_of("walk_hurt1", 3.0),
        "jog": rows_of("jog", 9.0),
    }
    return database(tmp_path / "database", clips)


def all_samples(data: Database) -> Block:
    """All samples of a pass."""
    return next(data.blocks("train", 0, 0, 1, 1, block_rows=10_000))


def poses(data: Database, x: Array) -> Array:
    """(n, 3 J) raw positions of the joints."""
    part, s = data.layout.x_joint_position, data.statistics
    return x[:, part] * s.x_std[part] + s.x_mean[part]


def mixed(data: Database, share: float = 1.0, places: slice = slice(None)) -> tuple[Block, Array]:
    """A block, and its X after some places of it were mixed."""
    block = all_samples(data)
    x = torch.from_numpy(block.x.copy())[places]
    first = places.start or 0
    versions = VersionPoses(data, share, range(first, first + len(x)), CPU)
    versions.begin_section()
    change(versions, x, torch.from_numpy(block.p)[places], block.clip[places])
    return block, x.numpy()


def test_poses_of_a_clip_and_its_version_move_evenly_to_both_sides(healthy_and_hurt: Database) -> None:
    """A mean other than the pose itself would make a running character exaggerate."""
    block, x = mixed(healthy_and_hurt)
    moved, names = poses(healthy_and_hurt, x)[:, 0], np.array(healthy_and_hurt.clips)[block.clip]
    for name, pose, atol in (("walk", 1.0, 0.5), ("walk_hurt1", 3.0, 0.15)):
        of_clip = np.sort(moved[names == name])
        of_clip = of_clip[np.abs(of_clip - pose) > 1e-4]
        np.testing.assert_allclose(of_clip, np.linspace(pose - 2, pose + 2, len(of_clip)), atol=atol)
    assert np.allclose(moved[names == "jog"], 9.0, atol=1e-3), "a clip without versions stays"


def test_only_the_pose_moves_and_only_in_a_share_of_the_rows(healthy_and_hurt: Database) -> None:
    block, x = mixed(healthy_and_hurt, 0.7)
    columns = np.r_[x_pose(healthy_and_hurt.layout.blocks("x"))]
    assert np.array_equal(np.delete(x, columns, axis=1), np.delete(block.x, columns, axis=1))
    names, changed = np.array(healthy_and_hurt.clips)[block.clip], (x != block.x).any(axis=1)
    for name, share in (("walk_hurt1", 0.7), ("walk", 0.035)):
        assert changed[names == name].mean() == pytest.approx(share, abs=0.01)


def test_a_row_gets_the_pose_of_its_own_phase(tmp_path: Path) -> None:
    """The healthy pose tells its phase, so a hurt row that moves all the way shows the phase that it took."""
    healthy, hurt = rows_of("walk", 0.0), rows_of("walk_hurt1", 50.0)
    x = healthy.x.copy()
    x[:, x_pose(healthy.layout.blocks("x"))] = 10 * healthy.p[:, None]
    data = database(tmp_path / "database", {"walk": replace(healthy, x=x), "walk_hurt1": hurt})
    block, moved = mixed(data)
    found = poses(data, moved)[:, 0]
    is_hurt = block.clip == data.clips.index("walk_hurt1")
    part = (50 - found[is_hurt]) / (50 - 10 * block.p[is_hurt])
    # With another phase these would not be the parts that are dealt out, and some would be above 1.
    np.testing.assert_allclose(np.sort(part), np.linspace(-1, 1, len(part)), atol=0.03)


def test_of_rows_with_that_phase_the_one_that_turns_alike_is_taken(tmp_path: Path) -> None:
    straight, turning = rows_of("walk", 1.0, rows=120), rows_of("walk", 3.0, rows=120, way=4.0)
    both = {
        name: np.concatenate([getattr(straight, name), getattr(turning, name)])
        for name in ("x", "y", "p", "frame", "cycle", "fits", "heights", "mean")
    }
    both["channels"] = {k: np.concatenate([v, turning.channels[k]]) for k, v in straight.channels.items()}
    clips = {"walk": replace(straight, **both), "walk_hurt1": rows_of("walk_hurt1", 3.0, way=4.0)}
    data = database(tmp_path / "database", clips)
    block, moved = mixed(data)
    is_hurt = block.clip == data.clips.index("walk_hurt1")
    assert np.allclose(poses(data, moved)[is_hurt, 0], 3.0, atol=1e-3), "the turning rows have its pose"


def test_the_ground_of_a_pose_is_subtracted(tmp_path: Path) -> None:
    """Both clips walk alike, on hills of different height. So there is nothing to move."""
    low, high = rows_of("walk", 1.0), rows_of("walk_hurt1", 1.0)
    raised = high.x.copy()
    raised[:, high.layout.x_joint_position.start + 1 : high.layout.x_joint_position.stop : 3] += 30.0
    data = database(
        tmp_path / "database", {"walk": low, "walk_hurt1": replace(high, x=raised, mean=high.mean + 30)}
    )
    block, moved = mixed(data)
    np.testing.assert_allclose(moved, block.x, atol=1e-4)


# Roll-outs: the poses have the errors that a running character would have.

FRAMES, STARTS = 5, 9


class Mixer:
    """A predictor whose Y is a fixed mixture of X."""

    def __init__(self, data: Database) -> None:
        self.network = SimpleNamespace(
            layout=data.layout, memory_size=0, memory_of=lambda x: np.zeros((len(x), 0))
        )
        shape = (data.layout.x_size, data.layout.y_size)
        self.mixture = np.random.default_rng(1).normal(0, 0.02, shape)
        self.mixture[:, data.layout.y_phase_change] = 0

    def predict(self, x: Any, phase: Any) -> Any:
        return x @ self.mixture


def straight(data: Database) -> RollOutInputs:
    """A clip whose joints move exactly by their velocities, with a root that stands on level ground."""
    layout, rng, rows = data.layout, np.random.default_rng(2), STARTS + FRAMES
    x, y = rng.normal(0, 5, (rows, layout.x_size)), rng.normal(0, 5, (rows, layout.y_size))
    for row in range(rows):
        if row:
            x[row, layout.x_joint_position] = y[row - 1, layout.y_joint_position]
            x[row, layout.x_joint_velocity] = y[row - 1, layout.y_joint_velocity]
        carried = x[row, layout.x_joint_position] + y[row, layout.y_joint_velocity]
        y[row, layout.y_joint_position] = carried
    still = np.zeros(rows)
    return RollOutInputs(x, y, still, still, still, np.zeros((rows, 2)), still)


def test_poses_carry_the_same_errors_as_a_roll_out(data: Database) -> None:
    """On consecutive rows, the result equals that of the evaluation's roll-out of the same clip."""
    layout, s = data.layout, data.statistics
    given, predictor = straight(data), Mixer(data)
    starts = np.arange(STARTS)
    made, _ = roll_out(predictor, given, starts, FRAMES)  # type: ignore[arg-type]
    carried = RollOut(data, 2 * STARTS, range(STARTS), CPU)
    carried.begin_section()
    whole = slice(FRAMES, None)  # places whose roll-out does not end meanwhile
    pose = x_pose(layout.blocks("x"))
    for age in range(FRAMES):
        at = starts + age
        added = torch.zeros(STARTS, layout.x_size)
        change(carried, added)
        off = added.numpy() * s.x_std
        if age:
            truth = given.y[at - 1][:, layout.y_joint_position]
            expected = (made[age - 1].reshape(STARTS, -1) - truth)[whole]
            assert off[whole, layout.x_joint_position] == pytest.approx(expected, rel=1e-3, abs=1e-3)
            assert np.abs(expected).max() > 1
        off[:, pose] = 0
        assert np.all(off == 0)
        error = predictor.predict(given.x[at] + added.numpy() * s.x_std, None) - given.y[at]
        carried.after(torch.from_numpy(error / s.y_std).float())


def test_each_place_restarts_after_its_frames(data: Database) -> None:
    """A fifth of the places restarts at every batch."""
    frames, rows = 5, 10
    carried = RollOut(data, frames, range(rows), CPU)
    carried.begin_section()
    zero = []
    for _ in range(3 * frames):
        x = torch.zeros(rows, data.layout.x_size)
        change(carried, x)
        zero.append((torch.count_nonzero(x, dim=1) == 0).numpy())
        carried.after(torch.ones(rows, data.layout.y_size))
    assert zero[0].all()
    counts = np.sum(zero[frames:], axis=1)
    assert set(counts) == {rows // frames}
    assert set(np.sum(zero[frames : 2 * frames], axis=0)) == {1}
