"""Jobs that read only their own clips build a database with the rows, statistics and mixing of one job."""

from __future__ import annotations

import shutil
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.core.errors import HobbleError, InputError
from hobble.database import write
from hobble.database.reader import Block, Database
from hobble.database.write import merge_shards, write_database, write_shard
from hobble.rows.clip_rows import load_clip_rows, save_clip_rows
from hobble.rows.layout import GAITS, RowLayout

OPTIONS = {"channels": ["injury"], "joint_weight": 0.1, "chunk_bytes": 20_000}
MEMORY, DISK = 4096, 0  # MB: everything at once, or one chunk at a time
SPLITS = {name: "held_out" if name in "be" else "train" for name in "abcdefg"}
SOURCES = {"b": "a", "f": "c"}


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


def in_shards(path: Path, clips, splits, groups, **more) -> Path:
    """The database of shards with the clips `groups`, each made from its own clips only."""
    options = {**OPTIONS, **more}
    folders = [path / "shards" / str(number) for number in range(len(groups))]
    for folder, own in zip(folders, groups, strict=True):
        some = {name: clips[name] for name in own}
        write_shard(folder, some, {name: splits[name] for name in own}, **options)
    last = {name: options[name] for name in ("joint_weight", "dtype") if name in options}
    merge_shards(path / "db", folders, **last)
    return path / "db"


def a_pass(path: Path, split: str, memory: int) -> Block:
    """Every pair of a pass, sorted by clip, frame and ground."""
    db = Database.open(path, memory)
    blocks = [b for section in range(3) for b in db.blocks(split, 0, section, 3, 1, 32)]
    whole = Block(*(np.concatenate(part) for part in zip(*blocks, strict=True)))
    clip = np.array(db.clips)[whole.clip]
    ground = np.round(whole.x[:, db.layout.x_terrain.start], 3)
    order = np.lexsort((ground, whole.frame, clip))
    return Block(whole.x[order], whole.y[order], whole.p[order], clip[order], whole.frame[order])


@pytest.mark.parametrize("memory", [MEMORY, DISK])
@pytest.mark.parametrize("groups", [["ab", "", "cdefg"], ["g", "be", "a", "d", "cf"]])
def test_a_pass_over_shards_has_the_pairs_of_an_unsharded_database(
    clips, tmp_path, monkeypatch, groups, memory
):
    monkeypatch.setattr(write, "BUCKET_BYTES", 50_000)
    write_database(tmp_path / "one", clips, SPLITS, sources=SOURCES, **OPTIONS)
    many = in_shards(tmp_path, clips, SPLITS, groups, sources=SOURCES)
    for split in ("train", "held_out"):
        a, b = a_pass(tmp_path / "one", split, memory), a_pass(many, split, memory)
        for name in ("clip", "frame", "p"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        np.testing.assert_allclose(a.x, b.x, rtol=1e-5, atol=2e-5)
        np.testing.assert_allclose(a.y, b.y, rtol=1e-5, atol=2e-5)


def test_statistics_and_limits_equal_those_of_an_unsharded_database(clips, tmp_path):
    one = write_database(tmp_path / "one", clips, SPLITS, sources=SOURCES, **OPTIONS)
    many = in_shards(tmp_path, clips, SPLITS, ["gb", "e", "ad", "cf"], sources=SOURCES)
    found = Database.open(many)
    for name, values in vars(Database.open(tmp_path / "one").statistics).items():
        np.testing.assert_allclose(vars(found.statistics)[name], values, rtol=1e-6)
    assert found.manifest.limits == one.limits
    assert np.ptp(one.limits["injury"]["speeds"][GAITS.index("walk")]) > 0.5
    assert found.manifest.original_bytes == one.original_bytes
    assert sorted(found.clips) == sorted(SPLITS)


def test_a_single_shard_equals_an_unsharded_database(clips, tmp_path):
    write_database(tmp_path / "one", clips, SPLITS, sources=SOURCES, **OPTIONS)
    in_shards(tmp_path / "many", clips, SPLITS, [list(clips)], sources=SOURCES)
    assert contents(tmp_path / "many" / "db") == contents(tmp_path / "one")


@pytest.mark.parametrize(("dtype", "relative"), [("float16", 2.0**-11), ("bfloat16", 2.0**-8)])
def test_values_in_half_precision_are_rounded_at_most_twice(clips, tmp_path, dtype, relative):
    """Once by the statistics of the shard, once by those of the database."""
    groups = ["ab", "cde", "fg"]
    full = a_pass(in_shards(tmp_path / "full", clips, SPLITS, groups), "train", DISK)
    half = a_pass(in_shards(tmp_path / "half", clips, SPLITS, groups, dtype=dtype), "train", DISK)
    order = [np.lexsort((b.x[:, -3].round(1), b.frame, b.clip)) for b in (full, half)]
    a, b = full.y[order[0]], half.y[order[1]]
    assert np.abs(np.sort(a, axis=0) - np.sort(b, axis=0)).max() < 12 * relative
    assert 0 < np.abs(np.sort(a, axis=0) - np.sort(b, axis=0)).mean() < relative


def test_a_new_clip_changes_its_shard_and_the_merge_only(clips, tmp_path):
    few = {name: file for name, file in clips.items() if name != "g"}
    in_shards(tmp_path, few, SPLITS, ["ab", "cd", "ef"])
    before = contents(tmp_path / "shards")
    write_shard(tmp_path / "shards/1", {n: clips[n] for n in "cdg"}, SPLITS, **OPTIONS)
    merge_shards(tmp_path / "db", [tmp_path / "shards" / n for n in "012"], joint_weight=0.1)
    after = contents(tmp_path / "shards")
    assert {name for name in {*before, *after} if before.get(name) != after.get(name)} <= {
        name for name in {*before, *after} if name.startswith("1/")
    }
    shutil.rmtree(tmp_path / "shards")
    other = in_shards(tmp_path / "anew", clips, SPLITS, ["ab", "cdg", "ef"])
    assert contents(tmp_path / "db") == contents(other)


def test_rows_are_linked_and_a_remade_shard_does_not_change_the_database(clips, tmp_path):
    db = in_shards(tmp_path, clips, SPLITS, ["abcd", "efg"])
    before = contents(db)
    chunks = list((tmp_path / "shards").rglob("*.safetensors"))
    assert len(chunks) > 4
    assert all(chunk.stat().st_nlink == 2 for chunk in chunks)
    write_shard(tmp_path / "shards/0", {"a": clips["a"]}, SPLITS, **OPTIONS)
    assert contents(db) == before


def test_rows_of_all_shards_are_mixed_like_independent_draws(rows_of, tmp_path):
    """As in test_reader.py, where one job merges: a feature that is constant for each clip."""
    clips = {f"c{i:02d}": rows_of(f"c{i:02d}", 400, 1, seed=i) for i in range(40)}
    groups = [list(clips)[:4], list(clips)[4:15], list(clips)[15:18], list(clips)[18:]]  # neighbours
    path = in_shards(tmp_path, clips, dict.fromkeys(clips, "train"), groups, channels=[], chunk_bytes=15_000)
    db = Database.open(path, 1)
    window, chunks = db.chunks_per_window("train", 32), len(db.manifest.chunks["train"])
    assert 2 * len(groups) <= window <= chunks // 15
    feature = np.concatenate([b.clip for s in range(3) for b in db.blocks("train", 0, s, 10, 1, 32)])
    feature = (feature - 19.5) / np.sqrt((40**2 - 1) / 12)
    n = len(feature)
    assert abs(np.mean(feature[1:] * feature[:-1])) < 4 / np.sqrt(n)  # twice this if any chunks form a window
    means = feature.reshape(-1, 32).mean(axis=1)
    assert 0.85 < means.var() * 32 < 1.15


def test_shards_refuse_the_same_bad_clips(clips, tmp_path, rows_of):
    with pytest.raises(HobbleError, match="nothing to train on"):
        in_shards(tmp_path, clips, dict.fromkeys(clips, "held_out"), ["abc", "defg"])
    other = replace(rows_of("z", 0), layout=RowLayout(3, window=30, channels=(("injury", 2),)))
    splits = {**SPLITS, "z": "train"}
    with pytest.raises(InputError, match=r"^z: the layout of its rows differs from that of a"):
        in_shards(tmp_path, {**clips, "z": other}, splits, ["abc", "z"])
    data = dict(np.load(clips["c"]))
    np.savez(clips["c"], **{**data, "layout": np.array("{}")})
    with pytest.raises(InputError, match=r"c\.npz: not a file of rows"):
        in_shards(tmp_path, clips, SPLITS, ["abc", "defg"])


@pytest.mark.parametrize("harm", ["{}", '{"plan": {}, "chunks": {}}'])
def test_a_damaged_shard_is_named(clips, tmp_path, harm):
    in_shards(tmp_path, clips, SPLITS, ["abc", "defg"])
    (tmp_path / "shards/1/shard.json").write_text(harm)
    with pytest.raises(InputError, match=r"1/shard\.json: not a shard"):
        merge_shards(tmp_path / "db", [tmp_path / "shards" / n for n in "01"], joint_weight=0.1)


def test_scales_of_other_shards_are_refused(clips, tmp_path):
    db = in_shards(tmp_path, clips, SPLITS, ["abc", "defg"])
    (scales,) = db.rglob("scales.npz")
    np.savez(scales, **{name: values[:1] for name, values in np.load(scales).items()})
    with pytest.raises(InputError, match=r"scales\.npz: not the statistics of 2 shards"):
        Database.open(db)


def test_the_memory_of_a_job_does_not_grow_with_the_shards(rows_of, tmp_path, monkeypatch):
    monkeypatch.setattr(write, "BUCKET_BYTES", 100_000)
    files = {}
    for number in range(16):
        files[f"c{number:02d}"] = tmp_path / f"c{number}.npz"
        save_clip_rows(files[f"c{number:02d}"], rows_of(f"c{number:02d}", 400, 10, seed=number))
    peaks = []
    for count in (4, 16):
        some = list(files)[:count]
        tracemalloc.start()
        groups = [some[n : n + 2] for n in range(0, count, 2)]
        in_shards(tmp_path / str(count), files, dict.fromkeys(files, "train"), groups)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0]


def test_of_hurt_versions_only_every_nth_row_is_used_and_each_version_starts_with_another(rows_of, tmp_path):
    names = ("a", "a1", "a2", "a3", "k", "k1")
    clips = {name: rows_of(name, 70, None, seed=i) for i, name in enumerate(names)}
    sources = {"a1": "a", "a2": "a", "a3": "a", "k1": "k"}
    splits = {name: "held_out" if name[0] == "k" else "train" for name in clips}
    write_database(tmp_path / "db", clips, splits, sources=sources, every=2, **OPTIONS)
    used = {"a": slice(None), "a1": slice(0, None, 2), "a2": slice(1, None, 2), "a3": slice(0, None, 2)}
    expected = {(name, int(frame)) for name, part in used.items() for frame in clips[name].frame[part]}
    block = a_pass(tmp_path / "db", "train", MEMORY)
    found = set(zip(block.clip.tolist(), block.frame.tolist(), strict=True))
    assert found == expected
    db = Database.open(tmp_path / "db", MEMORY)
    assert db.row_count("train") == 70 + 3 * 35
    assert db.row_count("held_out") == 140  # measured in full


def test_a_row_that_is_used_keeps_its_values_and_its_ground(rows_of):
    rows = rows_of("a", 23, None, seed=3)
    kept = rows.every(4, 2)
    kept.check("a")
    for new, old in enumerate(range(2, 23, 4)):
        for field in ("x", "y", "p", "frame", "cycle", "fits"):
            np.testing.assert_array_equal(getattr(kept, field)[new], getattr(rows, field)[old])
        np.testing.assert_array_equal(kept.channels["injury"][new], rows.channels["injury"][old])
        mine, his = (slice(r.first_fit[i], r.first_fit[i] + r.fits[i]) for r, i in ((kept, new), (rows, old)))
        np.testing.assert_array_equal(kept.heights[mine], rows.heights[his])
        np.testing.assert_array_equal(kept.mean[mine], rows.mean[his])


def test_speed_limits_are_learnt_from_all_rows(clips, tmp_path):
    """Speeds are means over whole cycles."""
    for file in clips.values():  # a clip that becomes faster in each cycle
        rows = load_clip_rows(file)
        rows.y[:, rows.layout.y_root_velocity] *= 1 + np.arange(len(rows))[:, None] % 15 / 30
        save_clip_rows(file, rows)
    whole = write_database(tmp_path / "whole", clips, SPLITS, sources=SOURCES, **OPTIONS)
    part = write_database(tmp_path / "part", clips, SPLITS, sources=SOURCES, every=3, **OPTIONS)
    assert part.limits == whole.limits
    assert part.row_count("train") < whole.row_count("train")
