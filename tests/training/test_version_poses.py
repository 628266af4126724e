"""Input poses that are moved between a clip and its hurt versions."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from hobble.core.quat import Array
from hobble.database.reader import Block, Database
from hobble.database.write import write_database
from hobble.rows.clip_rows import ClipRows
from hobble.training import augment
from hobble.training.augment import VersionPoses
from training.conftest import change, clip_rows

CPU = torch.device("cpu")
SOURCES = {"walk_hurt1": "walk", "walk_mirror_hurt1": "walk_mirror"}


def rows_of(name: str, pose: float, rows: int = 120, seed: int = 1, way: float = 0.0) -> ClipRows:
    """Rows of three cycles with one value in every column of the pose, on level ground."""
    made = clip_rows(name, rows, 1, seed)
    x = made.x.copy()
    for block in poses_of(made):
        x[:, block] = pose
    for block in (made.layout.x_direction, made.layout.x_gait):
        x[:, block] = way
    return replace(made, x=x, mean=0 * made.mean)


def poses_of(made: Any) -> tuple[slice, slice]:
    """Joints come before the terrain, so their columns are the same with and without it."""
    return made.layout.x_joint_position, made.layout.x_joint_velocity


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


def block_of(data: Database) -> Block:
    """All samples of a pass."""
    return next(data.blocks("train", 0, 0, 1, 1, block_rows=10_000))


def poses(data: Database, x: Array) -> Array:
    """(n, 3 J) raw positions of the joints."""
    part, s = data.layout.x_joint_position, data.statistics
    return x[:, part] * s.x_std[part] + s.x_mean[part]


def mixed(data: Database, share: float = 1.0, places: slice = slice(None)) -> tuple[Block, Array]:
    """A block, and its X after some places of it were mixed."""
    block = block_of(data)
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
    for name, pose in (("walk", 1.0), ("walk_hurt1", 3.0)):
        of_clip = np.sort(moved[names == name])
        np.testing.assert_allclose(of_clip, np.linspace(pose - 2, pose + 2, len(of_clip)), atol=0.15)
    assert np.allclose(moved[names == "jog"], 9.0, atol=1e-3), "a clip without versions stays"


def test_only_the_pose_moves_and_only_in_a_share_of_the_rows(healthy_and_hurt: Database) -> None:
    block, x = mixed(healthy_and_hurt, 0.25)
    columns = np.r_[poses_of(healthy_and_hurt)]
    assert np.array_equal(np.delete(x, columns, axis=1), np.delete(block.x, columns, axis=1))
    of_family = np.array(healthy_and_hurt.clips)[block.clip] != "jog"
    changed = (x != block.x).any(axis=1)
    assert changed[of_family].mean() == pytest.approx(0.25, abs=0.03)


def test_a_row_gets_the_pose_of_its_own_phase(tmp_path: Path) -> None:
    """The healthy pose tells its phase, so a hurt row that moves all the way shows the phase that it took."""
    healthy, hurt = rows_of("walk", 0.0), rows_of("walk_hurt1", 50.0)
    x = healthy.x.copy()
    for part in poses_of(healthy):
        x[:, part] = 10 * healthy.p[:, None]
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
        tmp_path / "database",
        {"walk": low, "walk_hurt1": replace(high, x=raised, mean=high.mean + 30)},
    )
    block, moved = mixed(data)
    np.testing.assert_allclose(moved, block.x, atol=1e-4)


def test_only_a_database_with_versions_has_this_augmentation(
    healthy_and_hurt: Database, data: Database, training: Any
) -> None:
    made = [
        augment.augmentations(d, training | {"version_poses": 0.5}, range(32), CPU)
        for d in (data, healthy_and_hurt)
    ]
    assert [len(each) for each in made] == [0, 1]
