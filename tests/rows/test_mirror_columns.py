"""The mirror of rows is that of the motion."""

import numpy as np
import pytest

from hobble.channels import channel
from hobble.core.errors import HobbleError
from hobble.core.skeleton import Skeleton
from hobble.labels import LabelOptions
from hobble.labels.label import label_clip, mirror_labels
from hobble.labels.local_phase import local_phases
from hobble.motion.edit import mirror_clip
from hobble.rows.build_rows import build_clip_rows
from hobble.rows.clip_rows import ClipRows, Pairs, pair_batches
from hobble.rows.layout import ColumnMirror, RowLayout, blocks_without_terrain, mirror_of_x, mirror_of_y
from hobble.synthetic.generate_clip import walk_from_plan
from hobble.synthetic.plan import Segment
from hobble.terrain.clip_fits import cycle_frames

OPTIONS = {"window": 60, "step": 10, "facing_sigma": 20.0}
SEGMENTS = [Segment("walk", 120, 60, 4), Segment("walk", 110, -20, 4)]
FRAMES = 480


def ground(frame: np.ndarray, cycle: np.ndarray) -> dict[str, np.ndarray]:
    """Other heights at every place of every row."""
    heights = np.random.default_rng(5).normal(0, 9, (FRAMES, 36))[frame]
    fits = np.ones(len(frame), np.int32)
    return {"frame": frame, "cycle": cycle, "fits": fits, "heights": heights, "patch": np.full((9, 10), -1)}


@pytest.fixture(scope="module")
def walked(holden31: Skeleton) -> tuple[ClipRows, ClipRows]:
    """Rows of a walk that turns, on uneven ground with injuries and a mood, and those of its mirror."""
    clip = walk_from_plan("walk", holden31, SEGMENTS, FRAMES, "flat", 60, 1).clip
    about = {"source_frames": FRAMES, "source_fps": 60.0}
    labels, report = label_clip(clip, [], about, "walk", "flat", LabelOptions())
    rng = np.random.default_rng(3)
    channels = {"injury": rng.uniform(0, 10, (FRAMES, 30)), "mood": rng.random((FRAMES, 5))}
    terrain = ground(*cycle_frames(labels.cycles))
    phases = local_phases(clip, labels.contacts)
    own = build_clip_rows("walk", clip, vars(labels), channels, terrain, local_phases=phases, **OPTIONS)
    image = mirror_clip(clip, "image")
    other, _ = mirror_labels(labels, report, image)
    turned = {name: channel(name).mirror(values, holden31) for name, values in channels.items()}
    there = ground(*cycle_frames(other.cycles))
    left, centre, right = np.split(there["heights"], 3, axis=1)
    there["heights"] = np.concatenate([right, centre, left], axis=1)
    phases = local_phases(image, other.contacts)
    return own, build_clip_rows("image", image, vars(other), turned, there, local_phases=phases, **OPTIONS)


def test_x_has_the_rotations_of_the_frame_before(walked: tuple[ClipRows, ClipRows]) -> None:
    rows, layout = walked[0], walked[0].layout
    follows = np.flatnonzero(np.diff(rows.frame) == 1)
    before = rows.x[:, blocks_without_terrain(layout)["joint_rotation"]][follows + 1]
    np.testing.assert_array_equal(before, rows.y[:, layout.y_joint_rotation][follows])


def in_both(own: ClipRows, other: ClipRows) -> tuple[Pairs, Pairs, np.ndarray, np.ndarray]:
    """The pairs of both, and the rows in each of the frames that both have (their cycles differ)."""
    (a,), (b,) = pair_batches(own, own.layout), pair_batches(other, other.layout)
    frames, i, j = np.intersect1d(own.frame, other.frame, return_indices=True)
    assert len(frames) > 200
    return a, b, i, j


def test_the_rows_of_a_mirrored_clip_are_the_mirrored_rows(holden31, walked):
    a, b, i, j = in_both(*walked)
    layout = walked[0].layout
    for prefix, mirror, mine, image in (
        ("x", mirror_of_x(layout, holden31), a.x, b.x),
        ("y", mirror_of_y(layout, holden31), a.y, b.y),
    ):
        for name, block in layout.blocks(prefix).items():
            found, wanted = mirror(mine[i])[:, block], image[j][:, block]
            np.testing.assert_allclose(found, wanted, atol=2e-4, err_msg=f"{prefix} {name}")
            apart = np.abs(mine[i][:, block] - wanted).max()
            same = ("gait", "mood", "phase_change", "local_change")
            assert apart > 1e-3 or name in same, f"{name} is not symmetric itself"


def test_standardised_rows_are_mirrored_as_raw_ones_are(holden31):
    layout = RowLayout(31)
    raw = mirror_of_y(layout, holden31)
    rng = np.random.default_rng(2)
    y, mean, std = rng.normal(0, 9, (4, layout.y_size)), rng.normal(0, 9, layout.y_size), rng.random(311)
    std = std + std[raw.source]
    found = raw.for_standardised_rows(mean, std)((y - mean) / std)
    np.testing.assert_allclose(found, (raw(y) - mean) / std, atol=1e-9)


def test_columns_that_are_scaled_apart_are_refused():
    swap = ColumnMirror(np.array([1, 0]), np.ones(2), np.zeros(2))
    with pytest.raises(HobbleError, match=r"columns 0 and 1 .* are 1 and 2\. .*mirror: true"):
        swap.for_standardised_rows(np.zeros(2), np.array([1.0, 2.0]))
