"""Files from strangers run no code, stay in their folders and take limited memory."""

from __future__ import annotations

import ast
import io
import json
import os
import pickle
import re
import resource
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from hobble.channels.injury.status import read_status
from hobble.channels.injury.table import write_statuses
from hobble.config.load import Catalogue
from hobble.core.clip import load_clip
from hobble.core.errors import HobbleError, InputError
from hobble.core.files import load_npz, read_json
from hobble.core.untrusted import read_bytes, read_yaml
from hobble.labels.files import SourceTime, read_gait_keys
from hobble.models import checks
from hobble.models.load import load_network
from hobble.motion import read as bvh
from hobble.motion.draft import MOST_SHOWN
from hobble.motion.make import make_clip
from hobble.motion.rig import load_skeleton
from hobble.terrain.heightmaps import heightmaps, read_heights
from hobble.terrain.options import Heightmap
from hobble.workflow.project import Project
from hobble.workflow.targets import check

from .texts import OPTIONS, SKELETON

MB = 1 << 20
HEADER = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 1 Xposition\n"


def refused(read: Callable[[], Any], *pieces: str, mb: int = 300, letters: int = 2000) -> None:
    """`read` raises a HobbleError with these pieces, takes less than `mb` of memory and fewer than
    `letters`.
    """
    read_end, write_end = os.pipe()
    pid = os.fork()
    if not pid:
        said = "nothing was refused"
        try:
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            most = pages * os.sysconf("SC_PAGE_SIZE") + mb * MB
            resource.setrlimit(resource.RLIMIT_AS, (most, most))
            read()
        except HobbleError as error:
            said = f"refused: {error}"
        except BaseException as error:
            said = f"{type(error).__name__}: {error}"
        finally:
            os.write(write_end, said.encode(errors="replace")[:60_000])
            os._exit(0)
    os.close(write_end)
    with os.fdopen(read_end, "rb") as pipe:
        said = pipe.read().decode()
    os.waitpid(pid, 0)
    assert said.startswith("refused: "), said[:2000]
    for piece in pieces:
        assert piece in said, said[:2000]
    assert len(said) < letters, len(said)


# Memory: BVH


def write(path: Path, text: str | bytes) -> Path:
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_two_billion_frames_are_refused_from_the_header(tmp_path: Path) -> None:
    text = f"{HEADER}}}\nMOTION\nFrames: 2000000000\nFrame Time: 0.0083\n" + "1\n" * 1000
    path = write(tmp_path / "a.bvh", text)
    refused(lambda: bvh.read_bvh(path), "a.bvh, line 8", "declares 2000000000 frames", mb=64)


@pytest.mark.parametrize("deep", [True, False])
def test_too_many_joints_are_refused_from_the_header(tmp_path: Path, deep: bool) -> None:
    closing = "" if deep else "}\n"
    joint = f"JOINT j%d\n{{\nOFFSET 0 1 0\n{closing}"
    joints = "".join(joint % i for i in range(5_000)) + joint * 295_000
    text = HEADER + joints + "}\n" * (300_001 if deep else 1) + "MOTION\nFrames: 1\nFrame Time: 0.0083\n1\n"
    path = write(tmp_path / "a.bvh", text)
    refused(lambda: bvh.read_bvh(path), "a.bvh, line ", f"more than {bvh.MOST_JOINTS} joints", mb=1000)


def test_as_many_joints_as_may_be_can_hang_from_each_other(tmp_path: Path) -> None:
    count = bvh.MOST_JOINTS - 1
    joints = "".join(f"JOINT j{i}\n{{\nOFFSET 0 1 0\n" for i in range(count))
    text = HEADER + joints + "}\n" * (count + 1) + "MOTION\nFrames: 1\nFrame Time: 0.0083\n1\n"
    path = write(tmp_path / "a.bvh", text)
    assert len(bvh.read_bvh(path).names) == bvh.MOST_JOINTS
    make = lambda: make_clip(path, SKELETON, SKELETON.parent, "a", "holden31", OPTIONS)  # noqa: E731
    more = f"  ... ({bvh.MOST_JOINTS - MOST_SHOWN} more; python -m hobble.motion rig a.bvh writes all)\n"
    refused(make, "a.bvh: the parts of this rig are in doubt: ", more, letters=6000)


def test_joints_without_channels_cost_memory_too(tmp_path: Path) -> None:
    joints = "".join(f"JOINT j{i}\n{{\nOFFSET 0 1 0\n}}\n" for i in range(4000))
    text = HEADER + joints + "}\nMOTION\nFrames: 20000\nFrame Time: 0.0083\n" + "1\n" * 20_000
    path = write(tmp_path / "a.bvh", text)
    refused(lambda: bvh.read_bvh(path), "20000 frames of 4001 joints", "shorter clips")


def test_a_slow_frame_rate_is_no_way_to_a_long_clip(tmp_path: Path, tiny_bvh: str) -> None:
    head, _, rest = tiny_bvh.partition("Frames: ")
    rows = rest.split("\n", 2)[2].strip().split("\n") * 20
    text = f"{head}Frames: {len(rows)}\nFrame Time: 10\n" + "\n".join(rows) + "\n"
    path = write(tmp_path / "a.bvh", text)
    make = lambda: make_clip(path, SKELETON, SKELETON.parent, "a", "holden31", OPTIONS)  # noqa: E731
    refused(make, "a.bvh: 3600 frames at 0.1 a second", "source_fps")


BODY = HEADER + "}\nMOTION\nFrames: 9\nFrame Time: 0.0083\n"
ENDLESS = {
    "a header of line ends": (HEADER + "\n" * bvh.MOST_HEADER, "MOTION comes after more than 16 MB"),
    "a header of one line": (HEADER + "x " * bvh.MOST_HEADER, "MOTION comes after more than 16 MB"),
    "MOTION again and again": ("HIERARCHY\n" + "MOTIONx " * 4 * MB + "\n", "there is no MOTION section"),
    "a frame of one line": (BODY + "1 " * 8 * MB, "line 10: a line of more than 4 MB"),
    "a number of one line": (BODY + "1" * 9 * MB + "\n1\n", "line 10: a line of more than 4 MB"),
    "a body of line ends": (BODY + "1\n" + "\n" * (bvh.MOST_LINES + 1), "more than 50000000 lines"),
}


@pytest.mark.parametrize("what", ENDLESS)
def test_lines_without_end_take_neither_memory_nor_time(tmp_path: Path, what: str) -> None:
    text, says = ENDLESS[what]
    path = write(tmp_path / "a.bvh", text + "}\nMOTION\n" if "header" in what else text)

    def read() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (30, 30))
        bvh.read_bvh(path)

    refused(read, "a.bvh", says)


def test_a_frame_may_still_run_over_many_lines(tmp_path: Path) -> None:
    head = HEADER.replace("1 Xposition", "3 Xposition Yposition Zposition")
    values = "".join(f"{k}\n\n" for k in range(30))
    path = write(tmp_path / "a.bvh", f"{head}}}\nMOTION\nFrames: 10\nFrame Time: 0.0083\n{values}")
    np.testing.assert_array_equal(bvh.read_bvh(path).values, np.arange(30.0).reshape(10, 3))


def test_files_without_end_are_not_read(tmp_path: Path) -> None:
    large = tmp_path / "large.bvh"
    with open(large, "wb") as file:
        file.truncate(bvh.MOST_BYTES + 1)
    refused(lambda: bvh.read_bvh(large), "large.bvh: larger than 1024 MB", mb=64)
    os.mkfifo(tmp_path / "pipe.bvh")
    (tmp_path / "zero.bvh").symlink_to("/dev/zero")
    (tmp_path / "folder.bvh").mkdir()
    for name, what in (("pipe", "a pipe"), ("zero", "a device"), ("folder", "not a file")):
        refused(lambda n=name: bvh.read_bvh(tmp_path / f"{n}.bvh"), f"{name}.bvh: ", what, mb=64)
    with pytest.raises(InputError, match="larger than 1 MB"):
        read_bytes(write(tmp_path / "a", bytes(MB + 1)), MB)
    assert len(read_bytes(write(tmp_path / "a", bytes(MB)), MB)) == MB


def test_a_status_file_that_counts_two_billion_frames_takes_no_room(tmp_path: Path) -> None:
    from hobble.channels.injury.severity import clip_severity
    from hobble.core.clip import Clip

    skeleton = load_skeleton(SKELETON).skeleton
    clip = Clip("a", skeleton, 60.0, np.tile([1.0, 0, 0, 0], (9, 31, 1)), np.zeros((9, 3)))
    path = write(tmp_path / "a_injuries.txt", "frames:2000000000\n1-2000000000 LeftUpLeg-LeftLeg[5];\n")
    motion = {"source_frames": 9, "source_fps": 60.0, "source": "a.bvh"}
    refused(lambda: clip_severity(clip, path, None, motion), "a_injuries.txt, line 1", mb=64)


# Memory: arrays, images, YAML, JSON


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
def test_a_header_that_python_trips_over_is_refused(tmp_path: Path, what: str) -> None:
    text = HEADERS[what].encode() + b"\n"
    array = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + bytes(64)
    path = zipped(tmp_path / "a.npz", {"heights.npy": array})
    for read in (load_npz, load_network, read_heights):
        refused(lambda r=read: r(path), "a.npz: damaged", mb=100, letters=400)
    path = write(tmp_path / "a.npy", array)
    refused(lambda: read_heights(path), "a.npy: not an array file", mb=100, letters=400)


def test_bytes_do_not_become_eight_times_as_much_as_numbers(tmp_path: Path) -> None:
    """A megabyte of compressed bytes that unpacks to a gigabyte of one-byte heights or weights."""
    path = tmp_path / "a.npz"
    side = 9000
    np.savez_compressed(path, heights=np.zeros((side, side), np.int8), W0=np.zeros((1, side, side), np.int8))
    assert path.stat().st_size < MB
    refused(lambda: read_heights(path), "a.npz: 81000000 heights, more than 67108864")
    arrays = {"Xmean": np.zeros(9), "W0": np.zeros((1, side, side), np.int8)}
    refused(lambda: checks.numbers("a.npz", arrays, "W0", 3), "W0 holds 81000000 numbers")


def test_a_layer_of_the_release_is_no_larger_than_it_may_be(tmp_path: Path) -> None:
    """Sparse files of many gigabytes."""
    for name in ("Xmean", "Xstd", "Ymean", "Ystd", "b0_000"):
        write(tmp_path / f"{name}.bin", bytes(4 << 16))
    with open(tmp_path / "W0_000.bin", "wb") as file:
        file.truncate(4 << 32)
    refused(lambda: load_network(tmp_path), "b0_000.bin: 65536 x 65536 weights", mb=64)


@pytest.mark.parametrize("text", ["1e308 2\n3 4\n", "nan 2\n3 -1e9\n"])
def test_ground_is_no_higher_than_the_world(tmp_path: Path, text: str) -> None:
    path = write(tmp_path / "a.txt", text)
    entry = Heightmap.model_validate({"kind": "file", "path": "a.txt"})
    refused(lambda: heightmaps([entry], [path], cell=4.0, height_scale=10.0), "a.txt: a height of")


@pytest.mark.parametrize(("kind", "value"), [(3, (7, 8)), (2, "none"), (7, b"\xff")])
def test_what_stands_for_no_data_may_be_anything(tmp_path: Path, kind: int, value: Any) -> None:
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
def test_arrays_are_packed_as_numpy_packs_them(tmp_path: Path, kind: int) -> None:
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


def test_an_image_that_says_it_is_huge_is_not_decoded(tmp_path: Path) -> None:
    def part(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    for side in (9_000, 60_000):
        header = part(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0))
        body = part(b"IDAT", zlib.compress(bytes(1000))) + part(b"IEND", b"")
        path = write(tmp_path / f"{side}.png", b"\x89PNG\r\n\x1a\n" + header + body)
        refused(lambda p=path: read_heights(p), f"{side}.png: ", mb=200)


LAUGHS = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12)
)
MERGES = "a0: &a0 {k: v}\n" + "".join(
    f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}]}}\n" for i in range(1, 12)
)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (LAUGHS, "aliases expand to more"),
        (MERGES, "aliases expand to more"),
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
def test_no_yaml_builds_a_mountain_or_an_object(
    tmp_path: Path, monkeypatch, text: str | bytes, says: str
) -> None:
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


# Code


class Payload:
    """An object that writes a file when it is unpickled."""

    def __reduce__(self) -> Any:
        return os.mkdir, ("pwned",)


def test_nothing_is_unpickled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    objects = np.array([Payload(), 1], dtype=object)
    np.savez(tmp_path / "a.npz", heights=objects, rotations=objects, W0=objects)
    np.save(tmp_path / "a.npy", objects)
    for name in ("bare.npz", "bare.npy", "bare.json", "bare.yaml", "bare.bvh", "bare.txt"):
        write(tmp_path / name, pickle.dumps(Payload()))
    skeleton = load_skeleton(SKELETON).skeleton
    readers: dict[str, list[Callable[[Path], Any]]] = {
        ".npz": [load_npz, load_clip, load_network, read_heights],
        ".npy": [read_heights],
        ".json": [read_json],
        ".yaml": [read_yaml, load_skeleton],
        ".bvh": [bvh.read_bvh],
        ".txt": [
            read_heights,
            lambda path: read_status(path, skeleton.link_names),
            lambda path: read_gait_keys(path, SourceTime(9, 60.0), 9),
        ],
    }
    for path in sorted(tmp_path.glob("*.*")):
        for read in readers[path.suffix]:
            with pytest.raises(InputError, match=re.escape(path.name)):
                read(path)
    assert not (tmp_path / "pwned").exists()


FORBIDDEN = {"eval", "exec", "compile", "__import__", "execfile"}
MODULES = {"pickle", "cPickle", "dill", "joblib", "marshal", "shelve", "cloudpickle"}
CALLS = {
    "os.system",
    "os.popen",
    "yaml.load",
    "yaml.unsafe_load",
    "yaml.full_load",
    "torch.load",
    "np.fromstring",
}


@pytest.mark.parametrize("folder", ["src", "workflow"])
def test_the_source_has_no_way_to_run_what_it_reads(root: Path, folder: str) -> None:
    found = []
    for path in sorted((root / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import | ast.ImportFrom):
                names = {alias.name for alias in node.names} | {getattr(node, "module", None)}
                found += [(path.name, name) for name in names & MODULES]
            if not isinstance(node, ast.Call):
                continue
            name = ast.unparse(node.func)
            keywords = {k.arg: ast.unparse(k.value) for k in node.keywords}
            if name in FORBIDDEN | CALLS or keywords.get("shell") == "True":
                found.append((path.name, name))
            if keywords.get("allow_pickle", "False") != "False":
                found.append((path.name, "allow_pickle"))
            if name in ("np.load", "numpy.load") and "allow_pickle" not in keywords:
                found.append((path.name, name))
    assert found == []
    # Rules run scripts and nothing else: no name ever reaches a shell.
    rules = [path.read_text() for path in sorted((root / folder).rglob("*.smk"))]
    assert not [text for text in rules if re.search(r"^\s*(shell|run)\s*:", text, re.M)]


# Paths


@pytest.fixture
def catalogue(root: Path, tmp_path: Path) -> Path:
    """A folder of configurations inside another one, with a configuration outside that must not be
    reachable.
    """
    folder = tmp_path / "checkout/config"
    (folder / "datasets").mkdir(parents=True)
    (folder / "skeletons").mkdir()
    (folder / "skeletons/holden31.yaml").write_bytes(SKELETON.read_bytes())
    write(tmp_path / "checkout/outside.yaml", "secret: 1\n")
    return folder


OUTSIDE = ["../outside", "/etc/passwd", "..", ".", "a/../../outside", "", "a\nb", "~root", "x" * 5000]


@pytest.mark.parametrize("name", OUTSIDE)
@pytest.mark.parametrize("key", ["extends", "dataset", "network_of", "continues"])
def test_a_configuration_names_nothing_outside_its_folder(catalogue: Path, key: str, name: str) -> None:
    value = {"training": {"continues": name}} if key == "continues" else {key: name}
    write(catalogue / "mine.yaml", json.dumps(value))
    write(catalogue / "datasets/synthetic.yaml", "skeleton: holden31\nfolder: x\n")
    with pytest.raises(HobbleError, match="mine") as refusal:
        check(Project(catalogue.parent, {}), ["results/mine/report.html"])
    assert "secret" not in str(refusal.value)


HUGE = {
    "network": {"units": 10**9},
    "training": {"batch": 10**12},
    "evaluation": {"laps": 10**12, "seconds": float("inf")},
}
HUGE_DATA = {
    "synthetic": {"frames": 10**15},
    "motion": {"loops": 10**9, "fps": float("inf")},
    "terrain": {"patches": 10**12, "size": 10**6},
    "database": {"window": 10**9, "step": 10**9},
}


def test_a_configuration_cannot_ask_for_a_mountain(catalogue: Path) -> None:
    for section, values in (HUGE | HUGE_DATA).items():
        for key, value in values.items():
            folder = catalogue if section in HUGE else catalogue / "datasets"
            given = {} if section in HUGE else {"skeleton": "holden31", "folder": "mine"}
            write(folder / "mine.yaml", yaml.safe_dump({**given, section: {key: value}}))
            read = Catalogue(catalogue).configuration if section in HUGE else Catalogue(catalogue).dataset
            refused(lambda read=read: read("mine"), "mine.yaml", f"{section}.{key}")


@pytest.mark.parametrize("value", ["../x", "/etc", "a/../../x", "a\nb", "x" * 5000, "x/" * 900])
@pytest.mark.parametrize("key", ["folder", "path", "skeleton", "source", "clips", "held_out"])
def test_a_data_set_names_nothing_outside_the_mocap_folder(catalogue: Path, key: str, value: str) -> None:
    given: dict[str, Any] = {"skeleton": "holden31", "folder": "mine"}
    more = {
        "path": {"terrain": {"heightmaps": [{"kind": "file", "path": value}]}},
        "clips": {"clips": {value: None}},
        "held_out": {"held_out": [value]},
    }
    write(catalogue / "datasets/mine.yaml", json.dumps(given | more.get(key, {key: value})))
    with pytest.raises(HobbleError, match=r"mine\.yaml"):
        Catalogue(catalogue).dataset("mine")


@pytest.mark.parametrize("value", [10**400, "x" * 9000, [1], None, "\x1b[31m"])
def test_a_skeleton_with_an_offset_that_is_no_number_is_refused(tmp_path: Path, value: Any) -> None:
    data = yaml.safe_load(SKELETON.read_text())
    data["joints"]["LHipJoint"]["offset"][1] = value
    path = write(tmp_path / "mine.yaml", yaml.safe_dump(data))
    with pytest.raises(InputError, match=r"mine\.yaml: not a skeleton file") as refusal:
        load_skeleton(path)
    assert len(str(refusal.value)) < 400
    assert str(refusal.value).isprintable()


def test_of_thousands_of_problems_twenty_are_listed(catalogue: Path) -> None:
    given = {"skeleton": "holden31", "folder": "mine", **{f"key {i}": 1 for i in range(5000)}}
    write(catalogue / "datasets/mine.yaml", yaml.safe_dump(given))
    refused(
        lambda: Catalogue(catalogue).dataset("mine"), "mine.yaml", "and 4980 more problems", letters=30_000
    )


@pytest.mark.parametrize(
    "name",
    [
        "<script>",
        "{clip}",
        "{0}",
        " walk",
        "walk ",
        "a\nb",
        "a\tb",
        "\x1b[31m",
        "a\\b",
        "\u202egpj",
        "é" * 101,
    ],
)
def test_clips_that_cannot_be_said_are_refused_with_their_folder(
    catalogue: Path, tmp_path: Path, name: str
) -> None:
    write(catalogue / "datasets/mine.yaml", "skeleton: holden31\nfolder: mine\n")
    folder = tmp_path / "mocap/mine"
    folder.mkdir(parents=True)
    write(folder / f"{name}.bvh", "HIERARCHY")
    with pytest.raises(InputError, match="mocap/mine: a clip is called") as refusal:
        Project(catalogue.parent, {"mocap": tmp_path / "mocap"}).clips.of("mine")
    assert str(refusal.value).isprintable()


def test_a_table_writes_beside_the_clips_and_nowhere_else(tmp_path: Path) -> None:
    (tmp_path / "clips").mkdir()
    for path in (tmp_path / "a.bvh", tmp_path / "clips/b.bvh"):
        write(path, "Frames: 9\n")
    links = ("LeftUpLeg-LeftLeg",)
    for name in ("../a", str(tmp_path / "a"), "x/../../a"):
        table = write(tmp_path / "t.csv", f"clip,link,severity,from,to\n{name},{links[0]},5,,\n")
        with pytest.raises(InputError, match=r"t\.csv, line 2: no such clip"):
            write_statuses(table, tmp_path / "clips", links)
    assert not list(tmp_path.rglob("*_injuries.txt"))


def test_links_are_read_through_and_never_written_through(tmp_path: Path) -> None:
    from hobble.core.files import write_text

    target = write(tmp_path / "precious", "precious")
    (tmp_path / "result.json").symlink_to(target)
    write_text(tmp_path / "result.json", "new")
    assert target.read_text() == "precious"
    assert (tmp_path / "result.json").read_text() == "new"
