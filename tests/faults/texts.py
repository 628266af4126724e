"""BVH and status files from the grammars are read by the real readers, and the outcome is checked."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings

from hobble.channels.injury.status import read_status, severity_matrix
from hobble.core.errors import InputError
from hobble.motion.make import make_clip
from hobble.motion.options import ClipMotion
from hobble.motion.skeleton_file import load_skeleton

from .grammar import BVH, STATUS, Case, cases
from .lab import ROOT
from .refusals import SECONDS

SKELETON = ROOT / "config/skeletons/holden31.yaml"
OPTIONS = ClipMotion()

Arrays = dict[str, np.ndarray]
Reader = Callable[[Path], Arrays]


def read_clip(path: Path) -> Arrays:
    """The clip made from a BVH file."""
    clip, report = make_clip(path, SKELETON, SKELETON.parent, "clip", "holden31", OPTIONS)
    assert all(math.isfinite(v) for v in report.values() if isinstance(v, float)), report
    turns = np.linalg.norm(clip.rotations, axis=-1)
    assert np.allclose(turns, 1, atol=1e-6), "rotations that are none"
    return {"rotations": clip.rotations, "root": clip.root, "positions": clip.positions}


def read_severity(path: Path) -> Arrays:
    """The severities of a status file, for a clip with as many frames."""
    links = load_skeleton(SKELETON).skeleton.link_names
    status = read_status(path, links)
    if status.frames > 100_000:  # the stage compares this with the clip before it makes room for it
        return {"frames": np.array(status.frames)}
    matrix, _ = severity_matrix(status, links)
    assert matrix.min() >= 0, "a severity below 0"
    assert matrix.max() <= 10, "a severity above 10"
    return {"severity": matrix}


def judge(case: Case, path: Path, read: Reader, whole: Arrays) -> str:
    """The outcome for a mutated file: "refused", "same" or "read". Raises AssertionError if it is wrong."""
    path.write_text(case.text, encoding="utf-8", newline="")
    refusal, began = None, time.process_time()
    try:
        found = read(path)
    except InputError as error:
        refusal = error
    except Exception as error:
        raise AssertionError(f"{case.names}: {type(error).__name__}: {error}") from error
    spent = time.process_time() - began
    assert spent < SECONDS, f"{case.names}: {spent:.1f} s of the processor"
    if refusal is None:
        return _judge_read(case, found, whole)
    text = str(refusal)
    assert text.startswith(str(path)), text
    assert "\n" not in text, text
    assert len(text) < 2000, text[:200]
    assert case.then != "same", f"{case.names}: {text}"
    assert refusal.line is not None or not case.placed, f"{case.names}: no line in {text!r}"
    return "refused"


def _judge_read(case: Case, found: Arrays, whole: Arrays) -> str:
    assert case.then != "refused", f"{case.names}: read all the same"
    for name, array in found.items():
        assert np.isfinite(array).all(), f"{case.names}: {name} is not finite"
    same = found.keys() == whole.keys() and all(np.array_equal(found[k], whole[k]) for k in whole)
    assert same or case.then != "same", f"{case.names}: read as something else"
    return "same" if same else "read"


def base_bvh(path: Path) -> str:
    """A BVH file of a second and a half."""
    head, _, rest = path.read_text().partition("Frames:")
    _, time, *rows = rest.strip().split("\n")
    return f"{head}Frames: 180\n{time}\n" + "\n".join(rows[:180]) + "\n"


def throw(
    which: str, base: str, folder: Path, examples: int, seed_: int, report: Callable[[Case, str], Any]
) -> None:
    """Read and judge files of a grammar ("bvh" or "status") that hypothesis generates from a seed."""
    read = read_clip if which == "bvh" else read_severity
    path = folder / ("clip.bvh" if which == "bvh" else "clip_injuries.txt")
    path.write_text(base)
    whole = read(path)

    def one(case: Case) -> None:
        report(case, judge(case, path, read, whole))

    phases = (Phase.generate, Phase.shrink)
    wanted = settings(
        max_examples=examples,
        deadline=None,
        database=None,
        phases=phases,
        suppress_health_check=list(HealthCheck),
    )
    seed(seed_)(wanted(given(cases(base, BVH if which == "bvh" else STATUS))(one)))()
