"""Heightmaps from files and generators."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from PIL.TiffImagePlugin import ImageFileDirectory_v2

from hobble.core.errors import InputError
from hobble.terrain.heightmaps import KINDS, generate_heights, read_heights

CELL = 3.937007874
RAMP = np.add.outer(np.arange(5.0), 10 * np.arange(4.0))


@pytest.mark.parametrize("kind", KINDS)
def test_equal_seeds_give_equal_ground_and_others_do_not(kind: str) -> None:
    one = generate_heights(kind, 3, CELL)
    assert one.shape == (400, 400)
    assert np.array_equal(one, generate_heights(kind, 3, CELL))
    assert not np.array_equal(one, generate_heights(kind, 4, CELL))
    assert np.isfinite(one).all()
    assert 20 < np.ptp(one) < 400


@pytest.mark.parametrize("suffix", [".txt", ".csv", ".npy", ".npz", ".png", ".tif"])
def test_every_kind_of_file_is_read_alike(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"map{suffix}"
    if suffix in (".png", ".tif"):
        Image.fromarray(RAMP.astype(np.uint16 if suffix == ".png" else np.float32)).save(path)
    elif suffix in (".txt", ".csv"):
        np.savetxt(path, RAMP, delimiter=" " if suffix == ".txt" else ",", header="heights")
    else:
        (np.save(path, RAMP) if suffix == ".npy" else np.savez(path, dx=np.array(1.0), z=RAMP))
    assert np.array_equal(read_heights(path), RAMP)


@pytest.mark.parametrize(
    ("dtype", "compression"), [(np.int16, None), (np.int32, "tiff_lzw"), (np.float32, "tiff_deflate")]
)
def test_a_geotiff_has_heights_below_zero_and_holes(tmp_path: Path, dtype, compression) -> None:
    """With GDAL's tags: size of a cell, position, and the value that means no data."""
    heights = (RAMP - 7).astype(dtype)
    heights[1, 2] = -9999
    tags = ImageFileDirectory_v2()
    tags[33550], tags[33922], tags[42113] = (10.0, 10.0, 0.0), (0, 0, 0, 5e5, 4e6, 0.0), "-9999"
    tags.tagtype.update({33550: 12, 33922: 12, 42113: 2})
    if dtype is np.int16:
        tags[339] = 2  # signed
    image = Image.fromarray(heights.view(np.uint16) if dtype is np.int16 else heights)
    image.save(tmp_path / "map.tif", tiffinfo=tags, compression=compression)
    read = read_heights(tmp_path / "map.tif")
    assert np.isnan(read[1, 2])
    assert np.array_equal(np.where(np.isnan(read), -9999, read), heights)


def test_an_esri_grid_has_a_header_and_holes(tmp_path: Path) -> None:
    header = "ncols 3\nnrows 2\nxllcorner 0.0\nyllcorner 0.0\ncellsize 30\nNODATA_value -9999\n"
    (tmp_path / "map.asc").write_text(header + "1 2 3\n4 -9999 6\n")
    assert np.array_equal(read_heights(tmp_path / "map.asc"), [[1, 2, 3], [4, np.nan, 6]], equal_nan=True)


BAD = {
    "empty.txt": (b"", "holds no heights"),
    "word.txt": (b"1 2 3\n4 five 6\n", "not rows of numbers: could not convert string 'five'"),
    "ragged.txt": (b"1 2 3\n4 5 6\n7 8\n", "number of columns changed from 3 to 2"),
    "nan.txt": (b"nan nan\nnan nan\n", "no finite height"),
    "not.png": (b"\x89PNG\r\n\x1a\n" + b"rubbish" * 9, "not an image"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_refused_by_name(tmp_path: Path, name: str) -> None:
    content, says = BAD[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=name) as raised:
        read_heights(tmp_path / name)
    assert says in str(raised.value)
