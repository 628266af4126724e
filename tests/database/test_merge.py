"""Merging: reproducible, complete or absent, small, in limited memory."""

import errno
import gc
import os
import random
import signal
import time
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.core.errors import HobbleError, InputError
from hobble.database import write
from hobble.database.reader import Database
from hobble.database.write import write_database
from hobble.rows.clip_rows import load_clip_rows, save_clip_rows
from hobble.rows.layout import RowLayout

OPTIONS = {"channels": ["injury"], "joint_weight": 0.1, "chunk_bytes": 40_000}


def contents(path: Path) -> dict[str, bytes]:
    return {str(f.relative_to(path)): f.read_bytes() for f in sorted(path.rglob("*")) if f.is_file()}


def read_all(path: Path) -> np.ndarray:
    """Every row of a database, in the order of clip and frame. Verifies the checksums."""
    db = Database.open(path, 4096)
    parts = [b for split in ("train", "held_out") for b in db.blocks(split, 0, 0, 10, 1)]
    rows = np.concatenate([np.column_stack([b.clip, b.frame]) for b in parts])
    return rows[np.lexsort(rows.T[::-1])]


def test_rows_round_trip_and_files_merge_like_rows_in_memory(rows_of, tmp_path):
    rows = {name: rows_of(name, 40, None, seed=i) for i, name in enumerate("abc")}
    splits = {"a": "train", "b": "held_out", "c": "train"}
    for name, clip in rows.items():
        save_clip_rows(tmp_path / f"{name}.npz", clip)
        back = load_clip_rows(tmp_path / f"{name}.npz")
        assert back.layout == clip.layout
        assert (back.clip, back.visits, back.skeleton) == (name, 10, clip.skeleton)
        assert list(back.skeleton["joints"]) == ["Hips", "Spine", "Head"]  # in the order of the columns
        for field in ("x", "y", "p", "frame", "cycle", "fits", "heights", "mean"):
            np.testing.assert_array_equal(getattr(back, field), getattr(clip, field))
        np.testing.assert_array_equal(back.channels["injury"], clip.channels["injury"])
    write_database(tmp_path / "one", rows, splits, **OPTIONS)
    files = {name: tmp_path / f"{name}.npz" for name in reversed("abc")}  # in any order
    write_database(tmp_path / "two", files, splits, **OPTIONS)
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    assert list(Database.open(tmp_path / "two").skeleton["joints"]) == ["Hips", "Spine", "Head"]


def test_a_network_without_local_phases_gets_rows_as_if_they_had_none(rows_of, tmp_path):
    rng, splits = np.random.default_rng(3), {"a": "train", "b": "held_out"}
    bare = {name: rows_of(name, 40, None, seed=i) for i, name in enumerate("ab")}
    rows = {}
    for name, clip in bare.items():
        more = (clip.x, 8 + 3 * clip.layout.joints), (clip.y, 12)
        x, y = (np.hstack([v, rng.normal(size=(len(v), n))]) for v, n in more)
        rows[name] = replace(clip, x=x, y=y, layout=replace(clip.layout, local_phases=4))
        rows[name].check(name)
        assert rows[name].layout.serves(clip.layout)
        assert not clip.layout.serves(rows[name].layout)
    write_database(tmp_path / "bare", bare, splits, **OPTIONS)
    write_database(tmp_path / "left out", rows, splits, **OPTIONS)
    assert contents(tmp_path / "bare") == contents(tmp_path / "left out")
    kept = write_database(tmp_path / "kept", rows, splits, local_phases=True, **OPTIONS)
    (block,) = Database.open(tmp_path / "kept").blocks("held_out", 0, 0, 1, 1)
    assert kept.layout == rows["b"].layout
    assert block.y.shape[1] == rows["b"].y.shape[1]
    one = Database.open(tmp_path / "kept").statistics
    expected = rows["a"].y[:, -12:].mean(axis=0)
    np.testing.assert_allclose(one.y_mean[-12:], expected, rtol=1e-5)


def test_every_row_is_stored_once_whatever_the_bucket_size(rows_of, tmp_path, monkeypatch):
    monkeypatch.setattr(write, "BUCKET_BYTES", 90_000)
    monkeypatch.setattr(write, "PART_ROWS", 17)
    rows = {name: rows_of(name, 150, None, seed=i) for i, name in enumerate("ab")}
    manifest = write_database(tmp_path / "db", rows, {"a": "train", "b": "held_out"}, **OPTIONS)
    chunks = manifest.chunks["train"]
    assert len({chunk.rows for chunk in chunks[:-1]}) == 1  # all but the last are of one length
    expected = [(clip, frame) for clip in range(2) for frame in range(60, 210)]
    np.testing.assert_array_equal(read_all(tmp_path / "db"), expected)


def test_training_may_use_every_fourth_frame(rows_of, tmp_path):
    """Also of hurt versions, each of which begins elsewhere; held-out clips keep all frames."""
    rows = {name: rows_of(name, 40, None, seed=i) for i, name in enumerate("abcd")}
    splits = {"a": "train", "b": "held_out", "c": "train", "d": "train"}
    hurt = {"c": "a", "d": "a"}
    steps = {"c": 2, "d": 3}
    write_database(tmp_path / "db", rows, splits, sources=hurt, hurt_every=steps, every=4, **OPTIONS)
    kept = [range(60, 100, 4), range(60, 100), range(60, 100, 8), range(64, 100, 12)]
    expected = [(clip, frame) for clip, frames in enumerate(kept) for frame in frames]
    np.testing.assert_array_equal(read_all(tmp_path / "db"), expected)


def test_memory_does_not_grow_with_the_number_of_clips(rows_of, tmp_path, monkeypatch):
    monkeypatch.setattr(write, "BUCKET_BYTES", 150_000)
    files = {}
    for i in range(8):
        files[f"c{i}"] = tmp_path / f"c{i}.npz"
        save_clip_rows(files[f"c{i}"], rows_of(f"c{i}", 300, 10, seed=i))

    def peak(n: int, turn: int) -> int:
        some = dict(list(files.items())[:n])
        gc.collect()
        tracemalloc.start()
        write_database(tmp_path / f"db{n}-{turn}", some, dict.fromkeys(some, "train"), **OPTIONS)
        try:
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    # The lower of two, because threads of other tests may allocate meanwhile.
    few, many = (min(peak(n, turn) for turn in range(2)) for n in (2, 8))
    assert many < 1.1 * few


@pytest.mark.slow
def test_a_build_killed_at_any_moment_leaves_the_old_database_or_the_new_one(rows_of, tmp_path):
    old = {"a": rows_of("a", 60, None, seed=1)}
    new = {**old, "b": rows_of("b", 900, 10, seed=2)}
    splits = {"a": "train", "b": "train"}
    path = tmp_path / "db"
    for _ in range(2):  # the first may be slow for reasons of its own
        started = time.monotonic()
        write_database(tmp_path / "timed", new, splits, **OPTIONS)
        whole = time.monotonic() - started
    expected = {len(read_all(tmp_path / "timed")), 60}
    chance = random.Random(1)
    killed, seen = 0, set()
    for attempt in range(100):
        if attempt >= 20 and killed >= 5:  # a build may be much faster than the one that was timed
            break
        before = old if attempt % 2 == 0 else None
        if before:
            write_database(path, before, splits, **OPTIONS)
        child = os.fork()
        if child == 0:
            write_database(path, new, splits, **OPTIONS)
            os._exit(0)
        time.sleep(chance.random() * 1.2 * whole)
        os.kill(child, signal.SIGKILL)
        killed += os.waitpid(child, 0)[1] != 0
        rows = read_all(path)
        assert len(rows) in expected
        seen.add(len(rows))
    assert killed >= 5
    write_database(path, new, splits, **OPTIONS)
    assert contents(path) == contents(tmp_path / "timed")  # and nothing is left lying about


def test_a_full_disk_gives_a_message_and_keeps_the_old_database(rows_of, tmp_path, monkeypatch):
    rows = {"a": rows_of("a", 60)}
    write_database(tmp_path / "db", rows, {"a": "train"}, **OPTIONS)
    before = contents(tmp_path / "db")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(write, "write_chunk", full)
    with pytest.raises(HobbleError, match="disk is full"):
        write_database(tmp_path / "db", {"a": rows_of("a", 61)}, {"a": "train"}, **OPTIONS)
    assert contents(tmp_path / "db") == before


def test_building_again_repairs_a_damaged_database(rows_of, tmp_path):
    rows = {"a": rows_of("a", 60)}
    manifest = write_database(tmp_path / "db", rows, {"a": "train"}, **OPTIONS)
    before = contents(tmp_path / "db")
    (tmp_path / "db" / manifest.folder / manifest.chunks["train"][0].file).write_bytes(b"")
    write_database(tmp_path / "db", rows, {"a": "train"}, **OPTIONS)
    assert contents(tmp_path / "db") == before


def test_clips_that_do_not_fit_together_are_refused(rows_of, tmp_path):
    a = rows_of("a", 30)
    with pytest.raises(HobbleError, match="nothing to train on"):
        write_database(tmp_path / "db", {"a": a}, {"a": "held_out"}, **OPTIONS)
    empty = rows_of("b", 0)
    with pytest.raises(HobbleError, match="nothing to train on"):
        write_database(tmp_path / "db", {"b": empty}, {"b": "train"}, **OPTIONS)
    other = replace(a, layout=RowLayout(3, window=30, channels=(("injury", 2),)))
    with pytest.raises(InputError, match=r"^z: the layout of its rows differs from that of a"):
        write_database(tmp_path / "db", {"a": a, "z": other}, {"a": "train", "z": "train"}, **OPTIONS)
    assert not (tmp_path / "db").exists()
