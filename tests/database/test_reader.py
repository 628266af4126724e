"""Reading: each pair once in a pass, well mixed, in limited memory, with checksums."""

import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import read_json
from hobble.database.chunks import to_stored_type
from hobble.database.reader import Block, Database
from hobble.database.write import write_database
from hobble.rows.clip_rows import pair_batches

MEMORY = 4096  # MB: everything at once
DISK = 0  # MB: one chunk at a time
OPTIONS = {"channels": ["injury"], "joint_weight": 0.1, "chunk_bytes": 40_000}


@pytest.fixture(scope="module")
def sources(rows_of):
    return {
        "flat": rows_of("flat", 90, 1, seed=1),
        "mixed": rows_of("mixed", 70, None, seed=2),
        "rocky": rows_of("rocky", 40, 10, seed=3),
        "kept": rows_of("kept", 30, 10, seed=4),
    }


@pytest.fixture(scope="module")
def path(sources, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("database") / "all"
    splits = {name: "held_out" if name == "kept" else "train" for name in sources}
    write_database(path, sources, splits, seed=3, **OPTIONS)
    return path


def whole_pass(
    db: Database, split: str, pass_index: int, sections: int, seed: int = 1, rows: int = 32
) -> Block:
    blocks = [
        block
        for section in range(sections)
        for block in db.blocks(split, pass_index, section, sections, seed, rows)
    ]
    return Block(*(np.concatenate(parts) for parts in zip(*blocks, strict=True)))


def keys(block: Block) -> list[tuple[int, int, bytes]]:
    """What identifies a pair: the clip, the frame and the ground under it."""
    return [
        (int(c), int(f), row.tobytes())
        for c, f, row in zip(block.clip, block.frame, block.x.round(4), strict=True)
    ]


@pytest.mark.parametrize("memory", [MEMORY, DISK])
def test_a_pass_has_every_standardised_pair_and_flat_rows_ten_times(path, sources, memory):
    db = Database.open(path, memory)
    assert len(db.manifest.chunks["train"]) > 5
    s = db.statistics
    for split, names in (("train", ("flat", "mixed", "rocky")), ("held_out", ("kept",))):
        got = whole_pass(db, split, 0, 10)
        assert len(got.p) == db.sample_count(split) == 10 * db.row_count(split)
        for name in names:
            rows = sources[name]
            mine = got.clip == db.clips.index(name)
            found: dict[int, list[int]] = {}
            for i in np.flatnonzero(mine):
                found.setdefault(int(got.frame[i]), []).append(i)
            for pairs in pair_batches(rows, rows.layout):
                x, y = (pairs.x - s.x_mean) / s.x_std, (pairs.y - s.y_mean) / s.y_std
                for k, row in enumerate(pairs.row):
                    at = found[int(rows.frame[row])]
                    same = [i for i in at if np.abs(got.x[i] - x[k]).max() < 2e-5]
                    assert len(same) == 10 // rows.fits[row], (name, row)
                    np.testing.assert_allclose(got.y[same[0]], y[k], atol=2e-5)
                    assert got.p[same[0]] == rows.p[row]


@given(st.integers(1, 13), st.integers(0, 3), st.integers(1, 70), st.sampled_from([MEMORY, DISK]))
@settings(max_examples=25, deadline=None)
def test_each_pair_comes_once_whatever_the_number_of_sections_and_blocks(
    path, sections, pass_index, rows, memory
):
    db = Database.open(path, memory)
    got = whole_pass(db, "train", pass_index, sections, rows=rows)
    assert Counter(keys(got)) == Counter(keys(whole_pass(db, "train", 7, 10)))


@pytest.mark.parametrize("memory", [MEMORY, DISK])
def test_no_section_of_a_usual_pass_shows_a_frame_twice(path, memory):
    db = Database.open(path, memory)
    for section in range(10):
        blocks = list(db.blocks("train", 0, section, 10, 1, 64))
        assert [len(b.p) for b in blocks] == [64, 64, 64, 8]
        seen = [(c, f) for b in blocks for c, f in zip(b.clip, b.frame, strict=True)]
        assert len(seen) == len(set(seen)) == 200


@pytest.mark.parametrize("memory", [MEMORY, DISK])
def test_passes_differ_in_order_and_a_section_is_the_same_after_a_restart(path, memory):
    db = Database.open(path, memory)
    first, second = (whole_pass(db, "train", i, 10) for i in range(2))
    places = first.clip * 1000 + first.frame, second.clip * 1000 + second.frame
    assert (places[0] == places[1]).mean() < 0.03
    other = whole_pass(db, "train", 0, 10, seed=2)
    assert (places[0] == other.clip * 1000 + other.frame).mean() < 0.03
    resumed = Database.open(path, memory)  # as after a kill: straight to section 6 of pass 1
    straight = list(resumed.blocks("train", 1, 6, 10, 1, 32))
    np.testing.assert_array_equal(np.concatenate([b.x for b in straight]), second.x[1200:1400])


def test_rows_are_mixed_like_independent_draws(rows_of, tmp_path):
    """A feature that is constant in a clip: variance of the batch means, and correlation of consecutive
    rows.
    """
    clips = {f"c{i:02d}": rows_of(f"c{i:02d}", 400, 1, seed=i) for i in range(40)}
    splits = dict.fromkeys(clips, "train")
    write_database(tmp_path / "db", clips, splits, channels=[], joint_weight=0.1, chunk_bytes=200_000)
    db = Database.open(tmp_path / "db", 1)
    assert 1 <= db.chunks_per_window("train", 32) <= len(db.manifest.chunks["train"]) // 20
    feature = np.concatenate([b.clip for s in range(3) for b in db.blocks("train", 0, s, 10, 1, 32)])
    feature = (feature - 19.5) / np.sqrt((40**2 - 1) / 12)
    n = len(feature)
    assert abs(np.mean(feature[1:] * feature[:-1])) < 4 / np.sqrt(n)
    means = feature.reshape(-1, 32).mean(axis=1)
    assert 0.85 < means.var() * 32 < 1.15  # 1 for independent draws; rows in the clips' order give 32


def test_half_precision_halves_the_size_and_hardly_changes_values(path, sources, tmp_path):
    with pytest.raises(HobbleError, match=r"7e\+04 does not fit float16.* float32"):
        to_stored_type(np.array([1.0, -7e4]), "float16")
    relative = 2.0**-11
    splits = {name: "held_out" if name == "kept" else "train" for name in sources}
    half = write_database(tmp_path / "db", sources, splits, seed=3, dtype="float16", **OPTIONS)
    full = Database.open(path, MEMORY)
    assert half.bytes < 0.56 * full.manifest.bytes  # phase, clip and frame stay whole numbers of four bytes
    for memory in (MEMORY, DISK):
        a = whole_pass(Database.open(tmp_path / "db", memory), "train", 0, 10)
        b = whole_pass(full, "train", 0, 10)
        order_a, order_b = (np.lexsort((m.x[:, -3], m.frame, m.clip)) for m in (a, b))
        assert a.x.dtype == np.float32
        near = {"rtol": 1.01 * relative, "atol": 2e-7}
        np.testing.assert_allclose(a.x[order_a][:, :20], b.x[order_b][:, :20], **near)
        twice = {"rtol": 4 * relative, "atol": 10 * relative}  # a row's height and a fit's lift are rounded
        np.testing.assert_allclose(np.sort(a.y, axis=0), np.sort(b.y, axis=0), **twice)


@pytest.mark.parametrize("harm", ["flip", "cut", "gone", "longer"])
def test_a_damaged_chunk_is_named(sources, tmp_path, harm):
    manifest = write_database(tmp_path / "db", sources, dict.fromkeys(sources, "train"), **OPTIONS)
    file = manifest.chunks["train"][3].file
    chunk = tmp_path / "db" / manifest.folder / file
    data = bytearray(chunk.read_bytes())
    if harm == "flip":
        data[len(data) // 2] ^= 1
    chunk.write_bytes({"cut": data[:-100], "longer": data + b"1234"}.get(harm, data))
    if harm == "gone":
        chunk.unlink()
    for memory in (MEMORY, DISK):
        with pytest.raises(InputError, match=file):
            whole_pass(Database.open(tmp_path / "db", memory), "train", 0, 10)


def test_a_manifest_that_differs_from_its_chunks_is_refused(sources, tmp_path):
    write_database(tmp_path, {"a": sources["rocky"]}, {"a": "train"}, **{**OPTIONS, "chunk_bytes": 10**6})
    manifest = read_json(tmp_path / "manifest.json")
    chunk = manifest["chunks"]["train"][0]
    for field, change in (("rows", -1), ("rows", 1), ("rows", 900), ("fits", -3), ("fits", 7)):
        other = {**manifest, "chunks": {"train": [{**chunk, field: chunk[field] + change}], "held_out": []}}
        (tmp_path / "manifest.json").write_text(json.dumps(other))
        with pytest.raises(InputError, match=f"{chunk['file']}|its clips have other rows"):
            whole_pass(Database.open(tmp_path, DISK), "train", 0, 10)


# A reader stays within the configured memory.


STATED = 8  # MB
CHILD = """
import os, resource, sys, threading
from pathlib import Path
from hobble.database.reader import Database

path, stated, allowed = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
threading.stack_size(1 << 20)
next(Database.open(path, 0).blocks("train", 0, 0, 10, 1, 32))  # what the program needs for itself
size = next(int(line.split()[1]) << 10 for line in open("/proc/self/status") if line.startswith("VmSize"))
most = size + ((allowed + 2) << 20)  # and two threads' stacks
resource.setrlimit(resource.RLIMIT_AS, (most, most))
db = Database.open(path, stated)
for file in Path(path).rglob("*.safetensors"):
    with open(file, "rb") as opened:
        os.posix_fadvise(opened.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
print(sum(len(block.p) for block in db.blocks("train", 0, 1, 10, 1, db.block_rows(32))))
"""


def read_within(path: Path, stated: int, allowed: int) -> subprocess.CompletedProcess[str]:
    """A section read from a cold cache by a process that gets no more address space than `allowed` MB."""
    one_arena = {**os.environ, "MALLOC_ARENA_MAX": "1"}  # else each thread reserves 64 MB
    arguments = [sys.executable, "-c", CHILD, str(path), str(stated), str(allowed)]
    return subprocess.run(arguments, env=one_arena, capture_output=True, text=True, check=False)


@pytest.mark.skipif(sys.platform != "linux", reason="limits and /proc of Linux")
def test_a_section_is_read_under_a_hard_limit_on_address_space(rows_of, tmp_path) -> None:
    """Of a database ten times as large."""
    clips = {f"c{i:02d}": rows_of(f"c{i:02d}", 2500, 10, seed=i) for i in range(16)}
    write_database(tmp_path, clips, dict.fromkeys(clips, "train"), **{**OPTIONS, "chunk_bytes": 300_000})
    assert sum(f.stat().st_size for f in tmp_path.rglob("*") if f.is_file()) > 10 * (STATED << 20)
    done = read_within(tmp_path, STATED, STATED)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) == 16 * 2500
    done = read_within(tmp_path, 4 * STATED, STATED)  # one that took more would not get through
    assert done.returncode != 0
    assert "MemoryError" in done.stderr
