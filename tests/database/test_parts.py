"""Many jobs build the same database as one, byte for byte, and none needs much memory."""

from __future__ import annotations

import shutil
import tracemalloc
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
import pytest

from hobble.core.errors import HobbleError, InputError
from hobble.database import plan
from hobble.database.merge import write_database
from hobble.database.parts import join_parts, write_part, write_shard
from hobble.rows.clip_rows import save_clip_rows
from hobble.rows.layout import GAITS
from hobble.workflow.datasets import shard_of

OPTIONS = {"channels": ["injury"], "chunk_bytes": 20_000}


@pytest.fixture
def clips(rows_of, tmp_path: Path) -> dict[str, Path]:
    """Clips of any length, one of them empty; all walk, and every second one is hurt and slower."""
    files = {}
    for number, name in enumerate("abcdefg"):
        rows = rows_of(name, 0 if name == "d" else 40 + 30 * number, None, seed=number)
        columns = rows.layout.with_channels(()).x_gait
        walk = np.eye(len(GAITS))[GAITS.index("walk")]
        rows.x[:, columns] = np.repeat(walk, rows.layout.samples)
        rows.y[:, rows.layout.y_root_velocity] = [0, 1 if number % 2 else 2 + number / 10]
        hurt = np.full((len(rows), 2), [7.0, 0.0] if number % 2 else 0.0, np.float32)
        files[name] = tmp_path / f"{name}.npz"
        save_clip_rows(
            files[name], replace(rows, channels={"injury": hurt}, cycle=np.arange(len(rows)) // 15)
        )
    return files


def contents(path: Path) -> dict[str, bytes]:
    return {str(f.relative_to(path)): f.read_bytes() for f in sorted(path.rglob("*")) if f.is_file()}


def in_parts(path: Path, clips, splits, shards: int, parts: int, dtype: str = "float32", **more) -> None:
    """As the workflow makes it."""
    names = sorted(clips)
    of_shards = [path / f"shard-{number}" for number in range(shards)]
    for number, folder in enumerate(of_shards):
        own = shard_of(names, number, shards)
        write_shard(folder, clips, own, splits, parts=parts, dtype=dtype, **OPTIONS, **more)
    of_parts = [path / f"part-{number}" for number in range(parts)]
    for number, folder in enumerate(of_parts):
        write_part(folder, of_shards, number, parts=parts, joint_weight=0.1, dtype=dtype)
    join_parts(path / "db", of_shards, of_parts, joint_weight=0.1, dtype=dtype)
    for folder in of_shards + of_parts:
        shutil.rmtree(folder)


@pytest.mark.parametrize(("shards", "parts"), [(1, 1), (2, 3), (3, 2), (7, 7), (9, 40)])
@pytest.mark.parametrize("held_out", ["", "be"])
def test_it_is_the_same_to_the_byte(clips, tmp_path, monkeypatch, shards, parts, held_out):
    monkeypatch.setattr(plan, "BUCKET_BYTES", 50_000)
    splits = {name: "held_out" if name in held_out else "train" for name in clips}
    sources = {"b": "a", "f": "c"}  # versions of clips that lie in other shards
    whole = write_database(tmp_path / "whole", clips, splits, sources=sources, joint_weight=0.1, **OPTIONS)
    assert np.ptp(whole.limits["injury"]["speeds"][GAITS.index("walk")]) > 0.5
    in_parts(tmp_path / "parts", clips, splits, shards, parts, sources=sources)
    assert contents(tmp_path / "parts" / "db") == contents(tmp_path / "whole")


@pytest.mark.parametrize("dtype", ["float16", "bfloat16"])
def test_in_half_precision_too(clips, tmp_path, dtype):
    splits = dict.fromkeys(clips, "train")
    write_database(tmp_path / "whole", clips, splits, joint_weight=0.1, dtype=dtype, **OPTIONS)
    in_parts(tmp_path / "parts", clips, splits, 2, 2, dtype)
    assert contents(tmp_path / "parts" / "db") == contents(tmp_path / "whole")


def test_every_clip_is_in_one_shard():
    names = [f"clip-{number}" for number in range(23)]
    found = [shard_of(names, number, 5) for number in range(5)]
    assert sorted(chain(*found)) == sorted(names)
    assert {len(shard) for shard in found} == {4, 5}


def test_many_jobs_refuse_what_one_job_refuses(clips, tmp_path, rows_of):
    with pytest.raises(HobbleError, match="nothing to train on"):
        in_parts(tmp_path / "parts", clips, dict.fromkeys(clips, "held_out"), 2, 2)
    data = dict(np.load(clips["c"]))
    np.savez(clips["c"], **{**data, "layout": np.array("{}")})
    with pytest.raises(InputError, match=r"c\.npz: not a file of rows"):
        in_parts(tmp_path / "parts", clips, dict.fromkeys(clips, "train"), 2, 2)


def test_a_shard_that_lacks_bytes_is_named(clips, tmp_path):
    splits = dict.fromkeys(clips, "train")
    shards = [tmp_path / "0", tmp_path / "1"]
    for number, folder in enumerate(shards):
        write_shard(folder, clips, shard_of(list(clips), number, 2), splits, parts=2, **OPTIONS)
    for table in ("frames", "fits"):
        file = tmp_path / "1" / "buckets-train" / f"00000.{table}"
        whole = file.read_bytes()
        file.write_bytes(whole[:-4])
        with pytest.raises(InputError, match=rf"00000\.{table}: truncated"):
            write_part(tmp_path / "part", shards, 0, parts=2, joint_weight=0.1)
        file.write_bytes(whole)
        shutil.rmtree(tmp_path / "part")


def test_a_job_holds_no_more_where_there_are_more_clips(rows_of, tmp_path, monkeypatch):
    """With as many more shards and parts: 8 bytes a row for the order, and the longest clip."""
    monkeypatch.setattr(plan, "BUCKET_BYTES", 100_000)
    files = {}
    for number in range(16):
        files[f"c{number:02d}"] = tmp_path / f"c{number}.npz"
        save_clip_rows(files[f"c{number:02d}"], rows_of(f"c{number:02d}", 400, 10, seed=number))
    peaks = []
    for count in (4, 16):
        some = dict(list(files.items())[:count])
        tracemalloc.start()
        in_parts(tmp_path / str(count), some, dict.fromkeys(some, "train"), count // 2, count // 2)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0] + 8 * 12 * 400
