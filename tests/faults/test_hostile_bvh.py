"""BVH and status files from strangers take limited memory and time."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from hobble.core.errors import InputError
from hobble.core.untrusted import read_bytes
from hobble.motion import read as bvh
from hobble.motion.make import make_clip
from hobble.motion.read import MOST_JOINTS
from hobble.motion.skeleton_file import load_skeleton

from .refusals import HEADER, MB, refused, write
from .texts import OPTIONS, SKELETON


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
    refused(lambda: bvh.read_bvh(path), "a.bvh, line ", f"more than {MOST_JOINTS} joints", mb=1000)


def test_the_longest_allowed_chain_of_joints_is_read(tmp_path: Path) -> None:
    count = MOST_JOINTS - 1
    joints = "".join(f"JOINT j{i}\n{{\nOFFSET 0 1 0\n" for i in range(count))
    text = (
        HEADER.replace("Xposition", "Zrotation")
        + joints
        + "}\n" * (count + 1)
        + "MOTION\nFrames: 1\nFrame Time: 0.0083\n1\n"
    )
    path = write(tmp_path / "a.bvh", text)
    assert len(bvh.read_bvh(path).names) == MOST_JOINTS
    make = lambda: make_clip(path, SKELETON, SKELETON.parent, "a", "holden31", OPTIONS)  # noqa: E731
    refused(make, "a.bvh: it is in doubt which joints are which parts of a body: ", "into it, and run again.")


def test_joints_without_channels_count_towards_the_memory_limit(tmp_path: Path) -> None:
    joints = "".join(f"JOINT j{i}\n{{\nOFFSET 0 1 0\n}}\n" for i in range(4000))
    text = HEADER + joints + "}\nMOTION\nFrames: 20000\nFrame Time: 0.0083\n" + "1\n" * 20_000
    path = write(tmp_path / "a.bvh", text)
    refused(lambda: bvh.read_bvh(path), "20000 frames of 4001 joints", "shorter clips")


def test_a_slow_frame_rate_cannot_make_a_clip_too_long(tmp_path: Path, tiny_bvh: str) -> None:
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
    "a frame of one line": (BODY + "1 " * 8 * MB, "declares 9 frames and has 8388608"),
    "a number of one line": (BODY + "1" * 9 * MB + "\n1\n", "line 10: a line of more than 4 MB"),
    "a body of line ends": (BODY + "1\n" + "\n" * 50_000_000, "declares 9 frames and has 1"),
}


@pytest.mark.parametrize("what", ENDLESS)
def test_lines_without_end_take_neither_memory_nor_time(tmp_path: Path, what: str) -> None:
    text, says = ENDLESS[what]
    path = write(tmp_path / "a.bvh", text + "}\nMOTION\n" if "header" in what else text)

    refused(lambda: bvh.read_bvh(path), "a.bvh", says)


def test_endless_files_are_refused(tmp_path: Path) -> None:
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
    from hobble.channels.injury.status import clip_severity
    from hobble.core.clip import Clip

    skeleton = load_skeleton(SKELETON).skeleton
    clip = Clip("a", skeleton, 60.0, np.tile([1.0, 0, 0, 0], (9, 31, 1)), np.zeros((9, 3)))
    path = write(tmp_path / "a_injuries.txt", "frames:2000000000\n1-2000000000 LeftUpLeg-LeftLeg[5];\n")
    motion = {"source_frames": 9, "source_fps": 60.0, "source": "a.bvh"}
    refused(lambda: clip_severity(clip, path, None, motion), "a_injuries.txt, line 1", mb=64)
