"""The tables have every frame once, in runs of consecutive frames, on the mean of its terrain fits."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.core.skeleton import Skeleton
from hobble.models.matching import MatchingOptions
from hobble.models.matching.build import feature_groups, find_runs, on_mean_ground
from hobble.rows.clip_rows import ClipRows, compose_pairs

from .example import CUT, FRAMES, built, clip, layout_of


@pytest.fixture
def rows(holden31: Skeleton) -> ClipRows:
    return clip(holden31, 0)


def test_a_frame_that_two_cycles_share_is_kept_once(rows: ClipRows) -> None:
    kept, remaining = find_runs(rows)
    np.testing.assert_array_equal(rows.frame[kept], 100 + np.arange(FRAMES[0]))
    assert rows.cycle[kept[CUT]] == 1, "the row with which a cycle begins"
    np.testing.assert_array_equal(remaining, np.arange(FRAMES[0])[::-1])


def test_a_gap_between_cycles_ends_a_run(rows: ClipRows) -> None:
    rows = replace(rows, frame=np.where(rows.cycle > 0, rows.frame + 30, rows.frame))
    kept, remaining = find_runs(rows)
    assert len(kept) == len(rows)
    np.testing.assert_array_equal(remaining, [*range(CUT, -1, -1), *range(len(rows) - CUT - 2, -1, -1)])


def test_rows_lie_on_the_mean_of_their_fits(rows: ClipRows) -> None:
    layout = rows.layout
    x, y = on_mean_ground(rows, layout)
    first = rows.first_fit
    each = [compose_pairs(rows, layout, np.arange(len(rows)), first + k) for k in range(2)]
    np.testing.assert_allclose(x, (each[0].x + each[1].x) / 2, atol=1e-5)
    np.testing.assert_allclose(y, (each[0].y + each[1].y) / 2, atol=1e-5)


def test_features_are_the_columns_that_their_names_say(holden31: Skeleton) -> None:
    layout, options = layout_of(holden31), MatchingOptions()
    found = {name: columns for name, columns, _ in feature_groups(layout, holden31, options)}
    # A third, two thirds and the whole of the window ahead: frames 20, 40 and the last sample, 50.
    assert found["path"] == [7, 9, 11, 19, 21, 23]
    assert found["facing"] == [24 + c for c in found["path"]]
    start = layout.x_joint_velocity.start
    assert found["hips velocity"] == [start, start + 1, start + 2]
    heel = layout.x_joint_position.start + 3 * holden31.index("RightFoot")
    assert found["right_heel position"] == [heel, heel + 1, heel + 2]
    assert found["gait"] == [48 + 12 * g + 6 for g in range(6)]
    assert len(found["injury"]) == 30


def test_a_group_has_its_configured_weight(holden31: Skeleton, tmp_path: Path) -> None:
    _, tables, _ = built(holden31, tmp_path, path=3.0, channels=20.0, gait=0.0)
    spread = tables["features"][:, :6].std(axis=0)
    assert spread.mean() == pytest.approx(3.0, rel=1e-4)
    assert spread.std() > 0.01, "its columns are divided by one number, not each by its own"
    gait = [i for i, column in enumerate(tables["columns"]) if 48 <= column < 120]
    assert not tables["feature_weights"][gait].any()
    # Severity 7 of at most 10.
    np.testing.assert_allclose(tables["features"][FRAMES[0] :, -26], 2 * 10 * 0.7**0.42, rtol=1e-5)
