"""Arrays, heightmaps, YAML and JSON from strangers take limited memory."""

from __future__ import annotations

import io
import pickle
import struct
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.config.load_configuration import Catalogue
from hobble.core.clip import load_clip
from hobble.core.declared import ArrayOf
from hobble.core.errors import InputError
from hobble.core.files import load_npz, read_json
from hobble.core.untrusted import read_yaml
from hobble.models.load import load_network, read_arrays
from hobble.motion.skeleton_file import load_skeleton
from hobble.terrain.heightmaps import read_heights

from .refusals import MB, refused, write


def npy(shape: tuple[int, ...], data: bytes = b"") -> bytes:
    text = str({"descr": "<f8", "fortran_order": False, "shape": shape}).encode()
    text += b" " * (-(len(text) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data


def zipped(path: Path, members: dict[str, bytes], kind: int = zipfile.ZIP_STORED) -> Path:
    with zipfile.ZipFile(path, "w", kind) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return path


def test_an_array_cannot_ask_for_more_than_the_file_holds(tmp_path: Path) -> None:
    path = zipped(tmp_path / "a.npz", {"heights.npy": npy((10**12,), bytes(800))})
    for read in (load_npz, load_clip, load_network, read_heights):
        refused(lambda r=read: r(path), "a.npz: damaged", mb=64)
    path = write(tmp_path / "a.npy", npy((10**6, 10**6), bytes(800)))
    refused(lambda: read_heights(path), "a.npy: not an array file", mb=64)


HEADERS = {
    "a dictionary that does not end": "{",
    "brackets that do not end": "(" * 9000,
    "signs without a number": "-" * 9000 + "1",
    "a text that does not end": "'''",
    "lines that go on": "\\\n" * 4000,
    "lines that stand nowhere": "  x\n y\n  z\n",
    "a type in brackets": "{'descr': ('<f8',), 'fortran_order': False, 'shape': (8,)}",
    "a length of 100 digits": "{'descr': '<f8', 'fortran_order': False, 'shape': (1%s,)}" % ("0" * 99),
    "a length below 0": "{'descr': '<f8', 'fortran_order': False, 'shape': (-8, -1)}",
    "a type of a terabyte": "{'descr': 'V1000000000000', 'fortran_order': False, 'shape': (8,)}",
    "objects": "{'descr': '|O', 'fortran_order': False, 'shape': (8,)}",
}


@pytest.mark.parametrize("what", HEADERS)
def test_a_damaged_array_header_is_refused(tmp_path: Path, what: str) -> None:
    text = HEADERS[what].encode() + b"\n"
    array = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + bytes(64)
    path = zipped(tmp_path / "a.npz", {"heights.npy": array})
    for read in (load_npz, load_network, read_heights):
        refused(lambda r=read: r(path), "a.npz: damaged", mb=100, letters=400)
    path = write(tmp_path / "a.npy", array)
    refused(lambda: read_heights(path), "a.npy: not an array file", mb=100, letters=400)


def test_arrays_of_one_byte_numbers_are_limited_in_memory(tmp_path: Path) -> None:
    """A megabyte of compressed bytes that unpacks to a gigabyte of one-byte heights or weights."""
    path = tmp_path / "a.npz"
    side = 9000
    np.savez_compressed(path, heights=np.zeros((side, side), np.int8), W0=np.zeros((1, side, side), np.int8))
    assert path.stat().st_size < MB
    refused(lambda: read_heights(path), "a.npz: 81000000 heights, more than 67108864")
    arrays = {"Xmean": np.zeros(9), "W0": np.zeros((1, side, side), np.int8)}
    declared = {"W0": ArrayOf((1, side, side), "fiu")}
    refused(lambda: read_arrays("a.npz", arrays, declared), "81000000 numbers; 1 to 67108864 are allowed")


def test_a_layer_of_the_release_that_is_too_large_is_refused(tmp_path: Path) -> None:
    """Sparse files of many gigabytes."""
    for name in ("Xmean", "Xstd", "Ymean", "Ystd", "b0_000"):
        write(tmp_path / f"{name}.bin", bytes(4 << 16))
    with open(tmp_path / "W0_000.bin", "wb") as file:
        file.truncate(4 << 32)
    refused(lambda: load_network(tmp_path), "b0_000.bin: 65536 x 65536 weights", mb=64)


@pytest.mark.parametrize(("kind", "value"), [(3, (7, 8)), (2, "none"), (7, b"\xff")])
def test_any_no_data_value_of_a_geotiff_is_handled(tmp_path: Path, kind: int, value: Any) -> None:
    from PIL import Image, TiffImagePlugin

    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags.tagtype[42113] = kind
    tags[42113] = value
    Image.fromarray(np.eye(4, dtype=np.uint8)).save(tmp_path / "a.tif", tiffinfo=tags)
    refused(lambda: read_heights(tmp_path / "a.tif"), "a.tif: not an image that can be read")


def test_a_zip_bomb_is_not_unpacked(tmp_path: Path) -> None:
    """Six megabytes that unpack to six gigabytes of zeros: one entry, listed six times."""
    gigabyte = npy((1 << 27,))[:-1] + b"\n"
    squeeze = zlib.compressobj(9, zlib.DEFLATED, -15)
    block = bytes(MB)
    packed, crc, length = squeeze.compress(gigabyte), zlib.crc32(gigabyte), len(gigabyte)
    for _ in range(64):
        packed, crc, length = packed + squeeze.compress(block), zlib.crc32(block, crc), length + MB
    packed += squeeze.flush()
    out, central = io.BytesIO(), b""
    for i in range(20):
        name = f"h{i}.npy".encode()
        facts = struct.pack("<HHHHHIIIHH", 20, 0, 8, 0, 0, crc, len(packed), length, len(name), 0)
        central += b"PK\1\2\x14\0" + facts + struct.pack("<HHHII", 0, 0, 0, 0, out.tell()) + name
        out.write(b"PK\3\4" + facts + name + packed)
    at = out.tell()
    out.write(central + b"PK\5\6" + struct.pack("<HHHHIIH", 0, 0, 20, 20, len(central), at, 0))
    path = write(tmp_path / "a.npz", out.getvalue())
    assert path.stat().st_size < 2 * MB
    for read in (load_npz, read_heights):
        refused(lambda r=read: r(path), "a.npz: damaged", "would unpack to more than 1024 MB", mb=200)


def test_entries_that_share_bytes_are_not_read_as_often_as_they_are_listed(tmp_path: Path) -> None:
    """One array of 8 MB, listed 400 times: 3.2 GB."""
    path = zipped(tmp_path / "a.npz", {"heights.npy": npy((MB,), bytes(8 * MB))})
    data = path.read_bytes()
    start, end = data.rindex(b"PK\x01\x02"), data.rindex(b"PK\x05\x06")
    entry, record = data[start:end], bytearray(data[end:])
    record[8:12] = struct.pack("<HH", 400, 400)
    record[12:16] = struct.pack("<I", 400 * len(entry))
    path.write_bytes(data[:start] + 400 * entry + record)
    for read in (load_npz, load_network, read_heights):
        refused(lambda r=read: r(path), "a.npz: damaged", "its entries overlap", mb=64)


@pytest.mark.parametrize("kind", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_a_file_of_arrays_has_the_layout_that_numpy_writes(tmp_path: Path, kind: int) -> None:
    path = zipped(tmp_path / "a.npz", {"heights.npy": npy((4, 4), bytes(128))}, kind)
    refused(lambda: load_npz(path), "a.npz: damaged", "compressed in a way that NumPy does not use")


POSTSCRIPT = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\n(pwned) (w) file\n%%EOF\n"


@pytest.mark.parametrize("suffix", [".png", ".tif", ".tiff", ".npy", ".npz", ".txt"])
@pytest.mark.parametrize("content", ["EPS", "BMP", "GIF", "PDF", "zip", "pickle"])
def test_a_heightmap_is_read_as_its_name_says_whatever_it_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, content: str
) -> None:
    from PIL import Image

    made = io.BytesIO()
    if content in ("BMP", "GIF", "PDF"):
        Image.new("L", (4, 4)).save(made, content)
    elif content == "zip":
        zipped(tmp_path / "z", {"other.txt": b"1 2\n3 4\n"})
        made.write((tmp_path / "z").read_bytes())
    else:
        made.write(POSTSCRIPT if content == "EPS" else pickle.dumps({"heights": 1}))
    path = write(tmp_path / f"map{suffix}", made.getvalue())
    started = []
    monkeypatch.setattr("subprocess.Popen.__init__", lambda *a, **k: started.append(a))
    with pytest.raises(InputError, match=f"map{suffix}"):
        read_heights(path)
    assert started == []


def test_an_image_of_too_many_pixels_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    """A PNG of a few bytes whose header says 60,000 by 60,000."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    for side in (9_000, 60_000):
        header = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
        data = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(1000))) + chunk(b"IEND", b"")
        path = write(tmp_path / "map.png", b"\x89PNG\r\n\x1a\n" + data)
        refused(lambda p=path: read_heights(p), "map.png: ", mb=64)


LAUGHS = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12)
)
MERGES = "a0: &a0 {k: v}\n" + "".join(
    f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}]}}\n" for i in range(1, 12)
)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (LAUGHS, "values, with its aliases expanded"),
        (MERGES, "values, with its aliases expanded"),
        ("a: &a [*a]\n", "contains itself"),
        ("a: " + "[" * 100_000, "a.yaml"),
        ("- " * 50_000 + "x", "a.yaml"),
        ("x" * (5 * MB), "larger than 4 MB"),
        ("a: !!python/object/apply:os.system ['touch pwned']\n", "line 1"),
        ("!!python/object/new:os.system ['touch pwned']\n", "line 1"),
        ("a: 2001-99-99\n", "not valid YAML"),
        ("\x00", "not valid YAML"),
        (b"\xff\xfe", "not a text file"),
    ],
)
def test_hostile_yaml_is_refused(tmp_path: Path, monkeypatch, text: str | bytes, says: str) -> None:
    monkeypatch.chdir(tmp_path)
    path = write(tmp_path / "a.yaml", text)
    for read in (
        lambda: read_yaml(path),
        lambda: Catalogue(tmp_path).configuration("a"),
        lambda: load_skeleton(path),
    ):
        refused(read, "a.yaml", says)
    assert not (tmp_path / "pwned").exists()


def test_json_that_is_too_deep_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.json", "[" * 200_000)
    refused(lambda: read_json(path), "a.json: not valid JSON", mb=100)
