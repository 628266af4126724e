"""Sizes of the files, and estimates for the released data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hobble.database.chunks import RELEASED_FLAT, RELEASED_FRAMES, database_sizes
from hobble.database.write import write_database
from hobble.rows.layout import RowLayout

PUBLISHED = {31: 7.12e9, 191: 10.4e9}  # bytes; the larger figure's with a quarter of the frames


@pytest.mark.parametrize("joints", PUBLISHED)
def test_the_size_of_the_released_data_follows_from_its_share_of_flat_rows(rows_of, tmp_path, joints):
    layout, frames = RowLayout(joints), 1000
    flat = round(frames * RELEASED_FLAT)

    def clip(name: str, rows: int, fits: int):
        x = np.ones((rows, layout.x_terrain.start), np.float32)
        skeleton = {"name": "s", "joints": {f"j{i}": {} for i in range(joints)}}
        return replace(
            rows_of(name, rows, fits),
            layout=layout,
            skeleton=skeleton,
            x=x,
            y=np.ones((rows, layout.y_size), np.float32),
            channels={},
        )

    clips = {"flat": clip("flat", flat, 1), "rocky": clip("rocky", frames - flat, 10)}
    splits = dict.fromkeys(clips, "train")
    manifest = write_database(tmp_path, clips, splits, channels=[], joint_weight=0.1)
    found = database_sizes(manifest)
    assert (found["frames"], found["pairs"], found["joints"]) == (frames, 10 * frames, joints)
    files = sum(f.stat().st_size for f in tmp_path.rglob("*.safetensors"))
    assert found["bytes"] == files
    assert found["released_bytes"] == pytest.approx(files / frames * RELEASED_FRAMES, rel=2e-3)
    assert found["share"] < 0.27
    assert found["released_bytes"] < PUBLISHED[joints] * (0.27 if joints == 31 else 0.6)
