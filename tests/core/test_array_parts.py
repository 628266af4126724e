"""Rows are read from the middle of a file, and damaged files are refused."""

from __future__ import annotations

import numpy as np
import pytest

from hobble.core.array_parts import ArrayParts
from hobble.core.errors import InputError
from hobble.core.files import save_npz


@pytest.fixture
def path(tmp_path):
    rng = np.random.default_rng(1)
    arrays = {
        "x": rng.normal(size=(50, 3, 2)),
        "frame": np.arange(50, dtype=np.int32),
        "name": np.array("walk"),
    }
    save_npz(tmp_path / "a.npz", **arrays)
    return tmp_path / "a.npz"


def test_rows_are_those_of_the_whole_array(path):
    whole = np.load(path)
    parts = ArrayParts(path)
    assert parts.names == ["x", "frame", "name"]
    assert parts.shape("x") == (50, 3, 2)
    for first, stop in ((0, 50), (7, 9), (49, 50), (20, 20), (48, 60)):
        for name in ("x", "frame"):
            found = parts.read_rows(name, first, stop)
            assert found.dtype == whole[name].dtype
            np.testing.assert_array_equal(found, whole[name][first:stop])
    assert str(parts.read_whole("name")) == "walk"
    assert "x" in parts
    assert "y" not in parts


def test_what_is_not_there_is_named(path, tmp_path):
    parts = ArrayParts(path)
    with pytest.raises(InputError, match=r"a\.npz: holds no array 'y'"):
        parts.read_rows("y", 0, 1)
    with pytest.raises(InputError, match="name has no rows"):
        parts.read_rows("name", 0, 1)
    with pytest.raises(InputError, match="no such file"):
        ArrayParts(tmp_path / "b.npz")


def test_a_file_that_became_shorter_is_refused(path):
    parts = ArrayParts(path)
    path.write_bytes(path.read_bytes()[:900])
    with pytest.raises(InputError, match="x does not fit into the file"):
        parts.read_rows("x", 0, 50)
    with pytest.raises(InputError, match="damaged or not an npz file"):
        ArrayParts(path)


@pytest.mark.parametrize("save", [np.savez_compressed, lambda p, x: np.savez(p, np.asfortranarray(x))])
def test_an_array_without_rows_one_after_another_is_refused(tmp_path, save):
    save(tmp_path / "c.npz", np.arange(6.0).reshape(2, 3))
    with pytest.raises(InputError, match="damaged or not an npz file"):
        ArrayParts(tmp_path / "c.npz")
