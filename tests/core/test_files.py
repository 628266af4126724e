"""Files are written completely or not at all, equal values give equal bytes, and errors say what to do."""

import contextlib
import errno
import subprocess

import numpy as np
import pytest

from hobble.core import files
from hobble.core.clip import Clip, load_clip, save_clip
from hobble.core.errors import HobbleError, InputError
from hobble.core.files import atomic_path, load_npz, map_npz, read_json, save_npz, write_json, write_text


def leftovers(folder):
    return [path.name for path in folder.iterdir() if path.name.startswith(".")]


def test_a_failed_write_leaves_the_old_file_and_no_temporary_one(tmp_path):
    path = tmp_path / "sub" / "a.txt"
    write_text(path, "old")

    def fail_half_way():
        with atomic_path(path) as temporary:
            temporary.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail_half_way()
    assert path.read_text() == "old"
    assert leftovers(path.parent) == []


@pytest.mark.parametrize(("number", "words"), [(errno.ENOSPC, "disk is full"), (errno.EROFS, "read-only")])
def test_a_disk_that_fills_ends_in_one_message(tmp_path, monkeypatch, number, words):
    path = tmp_path / "a.json"
    write_json(path, {"old": 1})

    def full(*_):
        raise OSError(number, "no")

    monkeypatch.setattr(files.os, "fsync", full)
    with pytest.raises(HobbleError, match=f"{path}.*{words}"):
        write_json(path, {"new": 2})
    assert read_json(path) == {"old": 1}
    assert leftovers(tmp_path) == []


@pytest.mark.parametrize("size_before", [2, 6])
def test_a_file_whose_size_changes_while_it_is_read_is_refused(tmp_path, monkeypatch, size_before):
    before, now = tmp_path / "before", tmp_path / "now"
    before.write_bytes(b"x" * size_before)
    now.write_bytes(b"x" * 4)
    monkeypatch.setattr(files, "check_regular", lambda path: path.with_name("before").stat())
    with pytest.raises(InputError, match="now: its size changed while it was read"):
        files.read_bytes(now, 10)


def test_only_what_is_wanted_is_loaded(tmp_path):
    path, rng = tmp_path / "a.npz", np.random.default_rng(1)
    arrays = {"x": rng.normal(size=(50, 3, 2)), "frame": np.arange(50, dtype=np.int32)}
    arrays |= {"name": np.array("walk"), "empty": np.zeros((0, 3))}
    save_npz(path, **arrays)
    assert list(load_npz(path, ["frame"])) == ["frame"]
    with pytest.raises(InputError):
        load_npz(path, ["z"])
    mapped = map_npz(path)
    assert list(mapped) == list(arrays)
    for name, array in arrays.items():
        assert (mapped[name].shape, mapped[name].dtype) == (array.shape, array.dtype)
        np.testing.assert_array_equal(mapped[name], array)
    with pytest.raises(InputError, match=r"a\.npz: holds no array 'y'"):
        _ = mapped["y"]
    path.write_bytes(path.read_bytes()[:900])
    with pytest.raises(InputError, match="damaged or not an npz file"):
        map_npz(path)
    for save in (np.savez_compressed, lambda p, x: np.savez(p, np.asfortranarray(x))):
        save(tmp_path / "c.npz", np.arange(6.0).reshape(2, 3))
        with pytest.raises(InputError, match="damaged or not an npz file"):
            map_npz(tmp_path / "c.npz")


def test_clips_round_trip(tmp_path, holden31):
    rng = np.random.default_rng(3)
    rotations = rng.normal(size=(9, 31, 4))
    rotations /= np.linalg.norm(rotations, axis=-1, keepdims=True)
    moved = np.tile(holden31.offsets, (9, 1, 1)) + 1
    for translations in (None, moved):
        clip = Clip("a-clip", holden31, 60.0, rotations, rng.normal(size=(9, 3)), translations)
        save_clip(tmp_path / "c.npz", clip)
        again = load_clip(tmp_path / "c.npz")
        assert (again.name, again.fps, len(again)) == ("a-clip", 60.0, 9)
        assert again.skeleton.to_dict() == holden31.to_dict()
        np.testing.assert_allclose(again.positions, clip.positions, atol=1e-3)
        np.testing.assert_allclose(np.linalg.norm(again.rotations, axis=-1), 1, atol=1e-12)
        np.testing.assert_array_equal(again.root, clip.root)
        assert (again.translations is None) == (translations is None)


def test_leftovers_of_killed_processes_are_removed(tmp_path):
    path = tmp_path / "a[1].json"
    child = subprocess.Popen(["true"])
    child.wait()
    places = ((files._HOST, child.pid), (files._HOST, 1), ("0" * 8, child.pid))
    dead, alive, elsewhere = (tmp_path / f".{path.name}.{host}.{pid}.part" for host, pid in places)
    for part in (dead, alive, elsewhere):
        part.write_text("half")
    write_json(path, {"whole": 1})
    assert sorted(leftovers(tmp_path)) == sorted([alive.name, elsewhere.name])


def test_every_flipped_bit_of_an_npz_is_detected_or_harmless(tmp_path):
    path = tmp_path / "a.npz"
    arrays = {"x": np.ones((2, 3), np.float32), "name": np.array("walk"), "none": np.zeros((0, 3))}
    save_npz(path, **arrays)
    whole = path.read_bytes()
    noticed = 0
    for at in range(len(whole)):
        flipped = bytearray(whole)
        flipped[at] ^= 1 << at % 8
        path.write_bytes(flipped)
        with contextlib.suppress(InputError):
            found = load_npz(path)
            assert found.keys() == arrays.keys()
            assert all(
                np.array_equal(found[k], arrays[k]) and found[k].dtype == arrays[k].dtype for k in found
            )
            noticed -= 1
        noticed += 1
    assert noticed > len(whole) * 2 // 3
