"""Files from strangers are refused in limited memory and time: text, BVH, arrays, images, YAML and JSON."""

import io
import json
import os
import pickle
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from hobble.channels.injury.status import read_status
from hobble.config.load_configuration import Catalogue
from hobble.core.clip import Clip, load_clip
from hobble.core.errors import InputError
from hobble.core.files import load_npz, read_json, read_yaml
from hobble.labels.label_files import SourceTime, read_phase
from hobble.measures.study import ShownFilm, Study, read_answers, read_study
from hobble.models.load import load_network
from hobble.motion import ClipMotion
from hobble.motion.make import make_clip
from hobble.motion.read import MOST_BYTES, MOST_HEADER, MOST_JOINTS, read_bvh
from hobble.motion.skeleton_file import load_skeleton
from hobble.terrain.heightmaps import read_heights

from .conftest import MB, SKELETON, refused, write
from .damage import change_text


def clip(path: Path) -> Clip:
    return make_clip(path, SKELETON, SKELETON.parent, "clip", "holden31", ClipMotion())[0]


def status(path: Path) -> Any:
    return read_status(path, ["A-B"])


def phase(path: Path) -> Any:
    return read_phase(path, SourceTime(200, 60.0), 200)


HEADER = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 1 Xposition\n"
BODY = HEADER + "}\nMOTION\nFrames: 9\nFrame Time: 0.0083\n"
END = "}\nMOTION\nFrames: %d\nFrame Time: 0.0083\n" + "1\n"

TURNS = END % 20 + "70\n" * 19


def joints(named: int, more: int = 0, deep: bool = False) -> str:
    """The first `named` joints have their own names."""
    closing = "" if deep else "}\n"
    joint = f"JOINT j%d\n{{\nOFFSET 0 1 0\n{closing}"
    text = "".join(joint % i for i in range(named)) + joint * more
    return HEADER + text + "}\n" * ((named + more) * deep)


def star(joints: int) -> str:
    """A BVH file in which all joints but one are children of the root."""
    turns = "CHANNELS 3 Zrotation Xrotation Yrotation"
    joint = f"JOINT j%d\n{{\nOFFSET %d %d 5\n{turns}\nEnd Site\n{{\nOFFSET 0 1 0\n}}\n}}\n"
    text = HEADER.replace("1 Xposition", turns.removeprefix("CHANNELS "))
    text += "".join(joint % (i, i % 7, 10 + i % 3) for i in range(joints))
    rows = "".join(" ".join(str((7 * f + i) % 50) for i in range(3 + 3 * joints)) + "\n" for f in range(200))
    return f"{text}}}\nMOTION\nFrames: 200\nFrame Time: 0.0166667\n{rows}"


STUDY = Study("s", "limp", ("a", "b"), tuple(ShownFilm(i, "one part", ("a",), (5.0,)) for i in range(1, 6)))


MARKS = dict.fromkeys(("fluidity", "progress", "realism"), "fair")
ANSWER = {"film": 1, "noticed": "yes", **MARKS, "parts": ["a"]}
FILM = {"film": 1, "kind": ["one part"], "parts": ["a"]}
FILMS = json.dumps({"study": "s", "configuration": "limp", "parts": ["a"], "films": [FILM]})

READERS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "status": ("a.txt", status), "phase": ("a.phase", phase), "bvh": ("a.bvh", read_bvh),
    "answers": ("a.json", lambda path: read_answers(path, STUDY)), "study": ("films.json", read_study),
    "json": ("a.json", read_json), "image": ("a.png", read_heights), "clip": ("a.bvh", clip),
}  # fmt: skip
BLANKS, DOUBT = " " * 6000, "it is in doubt which joints are which parts"
# What a file holds, or a function that makes it -> its reader, and what is said of it.
FILES: dict[str, tuple[str, str | bytes | Callable[[], str | bytes], str]] = {
    "blanks before a link": ("status", f"frames:10\n1-10 {BLANKS}x\n", "line 2: 'x' does not read as"),
    "2 million phases": ("phase", "0\n" * 2_000_000, "larger than 0.2"),
    "a star of 300 joints": ("clip", lambda: star(300), DOUBT),
    "HIERARCHY 2,000 times": ("clip", lambda: "HIERARCHY " * 2000 + star(1)[9:], "'HIERARCHY' is no joint"),
    "2 billion frames": ("bvh", BODY.replace("9", "2000000000", 1), "declares 2000000000 frames"),
    "300,000 joints deep": ("bvh", lambda: joints(5_000, 295_000, True) + END % 1, "more than 4096 joints"),
    "the longest chain of joints": (
        "clip", lambda: joints(MOST_JOINTS - 1, 0, True).replace("Xposition", "Zrotation") + TURNS, DOUBT
    ),
    "joints without channels": (
        "bvh", lambda: joints(4000) + END % 20_000 + "1\n" * 19_999, "20000 frames of 4001 joints"
    ),
    "a header of line ends": ("bvh", lambda: HEADER + "\n" * MOST_HEADER + END % 1, "MOTION comes after"),
    "many MOTIONs": ("bvh", lambda: "HIERARCHY\n" + "MOTIONx " * 4 * MB + "\n", "no MOTION section"),
    "a frame of one line": ("bvh", lambda: BODY + "1 " * 2 * MB, "declares 9 frames and has 2097152"),
    "a number of one line": ("bvh", lambda: BODY + "1" * 9 * MB + "\n1\n", "line 10: a line of more"),
    "50,000 answers": (
        "answers", json.dumps({"study": "s", "answers": [ANSWER] * 50_000}), "film 1 is answered twice"
    ),
    "a kind that is a list": ("study", FILMS, "films.0.kind: "),
    "an integer in JSON": ("json", "9" * 20_000, "not valid JSON"),
    "deep JSON": ("json", "[" * 200_000, "not valid JSON"),
    "a large image": ("image", lambda: png(60_000), "a.png: "),
    "an image of 81 million pixels": ("image", lambda: png(9_000), "a.png: "),
}  # fmt: skip


@pytest.mark.parametrize("what", FILES)
def test_it_is_refused_in_seconds(what: str, tmp_path: Path) -> None:
    reader, content, says = FILES[what]
    name, read = READERS[reader]
    path = write(tmp_path / name, content() if callable(content) else content)
    refused(lambda: read(path), name, says, mb=1000 if "300,000" in what else 300, letters=5000)


def test_endless_files_are_refused(tmp_path: Path) -> None:
    with open(tmp_path / "large.bvh", "wb") as file:
        file.truncate(MOST_BYTES + 1)
    os.mkfifo(tmp_path / "pipe.bvh")
    (tmp_path / "zero.bvh").symlink_to("/dev/zero")
    (tmp_path / "folder.bvh").mkdir()
    says = {"large": "larger than 1024 MB", "pipe": "a pipe", "zero": "a device", "folder": "not a file"}
    for name, what in says.items():
        refused(lambda n=name: read_bvh(tmp_path / f"{n}.bvh"), f"{name}.bvh: ", what, mb=64)


def test_a_damaged_clip_gives_a_sound_result_or_one_message(tmp_path: Path, tiny_bvh: str) -> None:
    path, messages, sound = tmp_path / "a.bvh", list[str](), 0
    for number in range(60):
        write(path, change_text(Random(number), tiny_bvh).encode(errors="surrogateescape"))
        try:
            assert np.isfinite(clip(path).positions).all(), number
            sound += 1
        except InputError as error:
            messages.append(str(error))
    assert [m for m in messages if not (m.startswith(str(path)) and m.isprintable() and len(m) < 2000)] == []
    assert min(sound, len(messages)) > (sound + len(messages)) / 5


def npy(shape: tuple[int, ...], data: bytes = bytes(800), header: str = "") -> bytes:
    text = (header or str({"descr": "<f8", "fortran_order": False, "shape": shape})).encode()
    text += b" " * (-(len(text) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data


def zipped(path: Path, data: bytes, kind: int = zipfile.ZIP_STORED) -> Path:
    with zipfile.ZipFile(path, "w", kind) as archive:
        archive.writestr("heights.npy", data)
    return path


HEADERS = {
    "more than the file holds": str({"descr": "<f8", "fortran_order": False, "shape": (10**12,)}),
    "brackets that do not end": "(" * 9000,
    "a type of a terabyte": "{'descr': 'V1000000000000', 'fortran_order': False, 'shape': (8,)}",
}


@pytest.mark.parametrize("what", HEADERS)
def test_a_hostile_array_header_is_refused(tmp_path: Path, what: str) -> None:
    array = npy((), bytes(64), HEADERS[what])
    path = zipped(tmp_path / "a.npz", array)
    for read in (load_npz, load_clip, load_network, read_heights):
        refused(lambda r=read: r(path), "a.npz: damaged", mb=64, letters=400)
    path = write(tmp_path / "a.npy", array)
    refused(lambda: read_heights(path), "a.npy: not an array file", mb=64, letters=400)


def test_a_zip_bomb_is_not_unpacked(tmp_path: Path) -> None:
    """Its list of files says that a compressed array unpacks to two gigabytes."""
    path = zipped(tmp_path / "a.npz", npy((MB,), bytes(8 * MB)), zipfile.ZIP_DEFLATED)
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, data.rindex(b"PK\x01\x02") + 24, 1 << 31)
    path.write_bytes(data)
    for read in (load_npz, read_heights):
        refused(lambda r=read: r(path), "a.npz: damaged", "would unpack to more than 1024 MB", mb=64)


def test_entries_that_share_bytes_are_not_read_as_often_as_they_are_listed(tmp_path: Path) -> None:
    """One array of 8 MB, listed 400 times: 3.2 GB."""
    path = zipped(tmp_path / "a.npz", npy((MB,), bytes(8 * MB)))
    data = path.read_bytes()
    start, end = data.rindex(b"PK\x01\x02"), data.rindex(b"PK\x05\x06")
    entry, record = data[start:end], bytearray(data[end:])
    record[8:12] = struct.pack("<HH", 400, 400)
    record[12:16] = struct.pack("<I", 400 * len(entry))
    path.write_bytes(data[:start] + 400 * entry + record)
    for read in (load_npz, load_network, read_heights):
        refused(lambda r=read: r(path), "a.npz: damaged", "its entries overlap", mb=64)


def png(side: int) -> bytes:
    """A PNG of a few bytes whose header says so many pixels."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
    data = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(1000))) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + data


def test_a_heightmap_is_read_as_its_name_says_whatever_it_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from PIL import Image

    eps = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\n(pwned) (w) file\n%%EOF\n"
    made = io.BytesIO()
    Image.new("L", (4, 4)).save(made, "BMP")
    contents = [eps, made.getvalue(), zipped(tmp_path / "z", b"1 2\n3 4\n").read_bytes()]
    started: list[Any] = []
    monkeypatch.setattr("subprocess.Popen.__init__", lambda *a, **k: started.append(a))
    for suffix in (".png", ".tif", ".tiff", ".npy", ".npz", ".txt"):
        for content in contents:
            path = write(tmp_path / f"map{suffix}", content)
            with pytest.raises(InputError, match=f"map{suffix}"):
                read_heights(path)
    assert started == []


# Each list holds the one before it nine times.
MULTIPLIED = "a0: &a0 [x]\n" + "".join(f"a{i}: &a{i} [{f'*a{i - 1}, ' * 9}]\n" for i in range(1, 12))
YAML: dict[str, tuple[str | bytes, str]] = {
    "aliases that multiply": (MULTIPLIED, "alias"),
    "deep brackets": ("a: " + "[" * 100_000, "a.yaml"),
    "much text": ("x" * (5 * MB), "larger than 4 MB"),
    "a call": ("a: !!python/object/apply:os.system ['touch pwned']\n", "line 1"),
    "a wrong date": ("a: 2001-99-99\n", "not valid YAML"),
    "no text": (b"\xff\xfe", "not a text file"),
    "an integer of 20,000 digits": ("a: 1\nb: " + "9" * 20_000, "line 2: an integer of"),
}


@pytest.mark.parametrize("what", YAML)
def test_hostile_yaml_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    monkeypatch.chdir(tmp_path)
    path = write(tmp_path / "a.yaml", YAML[what][0])
    for read in (
        lambda: read_yaml(path),
        lambda: Catalogue(tmp_path).configuration("a"),
        lambda: load_skeleton(path),
    ):
        refused(read, "a.yaml", YAML[what][1])
    assert not (tmp_path / "pwned").exists()


class Payload:
    """An object that writes a file when it is unpickled."""

    def __reduce__(self) -> Any:
        return os.mkdir, ("pwned",)


def test_nothing_is_unpickled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    objects = np.array([Payload(), 1], dtype=object)
    np.savez(tmp_path / "a.npz", heights=objects, rotations=objects, W0=objects)
    np.save(tmp_path / "a.npy", objects)
    write(tmp_path / "bare.npz", pickle.dumps(Payload()))
    write(tmp_path / "bare.npy", pickle.dumps(Payload()))
    for path in sorted(tmp_path.glob("*.*")):
        for read in (load_npz, load_clip, load_network, read_heights):
            with pytest.raises(InputError, match=re.escape(path.name)):
                read(path)
    assert not (tmp_path / "pwned").exists()
