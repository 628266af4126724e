"""Automatic labels compared with hand-made ones, and file labels with the original's own rows."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.core.clip import Clip
from hobble.labels import LabelOptions as Options
from hobble.labels.clip_labels import Labels
from hobble.labels.label import label_clip, mirror_labels
from hobble.motion import ClipMotion
from hobble.motion.make import make_clip

SUFFIXES = (".phase", ".gait", "_footsteps.txt", "_gait.txt")
PFNN = ["pfnn/LocomotionFlat04_000", "pfnn/LocomotionFlat09_000"]
FERRE = [f"ferre/Injured_{name}_extended_converted" for name in ("Run_LLL", "Walk_LLL", "Walk_RUL")]
WALK, JOG = 1, 2


@pytest.fixture(scope="module")
def read(root: Path) -> Callable[[Path], tuple[Clip, dict[str, Any]]]:
    """Reads a BVH file with its own proportions."""
    options, folder = ClipMotion(proportions="clip"), root / "config/skeletons"

    @cache
    def of(path: Path) -> tuple[Clip, dict[str, Any]]:
        return make_clip(path, folder / "holden31.yaml", folder, path.stem, "holden31", options)

    return of


def both_ways(read, bvh: Path, options: dict, ground: str = "rocky") -> tuple[Labels, Labels]:
    """Labels of a clip from its files, and from its motion alone."""
    clip, motion = read(bvh)
    stem = str(bvh.with_suffix(""))
    files = [stem + s for s in SUFFIXES if Path(stem + s).is_file()]
    by_hand, report = label_clip(clip, files, motion, None, ground, options)
    assert (report.phase_source, report.gait_source) == ("file", "file")
    automatic, _ = label_clip(clip, [], motion, None, ground, options)
    return by_hand, automatic


def phase_difference(by_hand: Labels, automatic: Labels) -> float:
    """Mean circular difference on walking and jogging frames, cycles."""
    gait = by_hand.gait.argmax(axis=1)
    frames = by_hand.phase_known & automatic.phase_known & ((gait == WALK) | (gait == JOG))
    apart = np.abs((automatic.phase - by_hand.phase + 0.5) % 1.0 - 0.5)
    return float(apart[frames].mean())


def landings(labels: Labels) -> list[tuple[float, int]]:
    return [(x, foot) for row in labels.footsteps for foot, x in enumerate(row[:2]) if np.isfinite(x)]


def matched(by_hand: Labels, automatic: Labels, first: float, last: float) -> tuple[list, list]:
    """The landings of both between two frames, in order. Both must have the same feet."""
    ours, theirs = landings(automatic), landings(by_hand)
    theirs = [x for x in theirs if first <= x[0] <= last]
    begin = min(
        range(len(ours)), key=lambda i: abs(ours[i][0] - theirs[0][0]) + 1e3 * (ours[i][1] != theirs[0][1])
    )
    return ours[begin : begin + len(theirs)], theirs


@pytest.mark.shared
@pytest.mark.parametrize("name", PFNN + FERRE)
def test_automatic_labels_agree_with_hand_made_ones(shared: Path, read, options, name):
    by_hand, automatic = both_ways(read, shared / "mocap" / f"{name}.bvh", options)
    assert phase_difference(by_hand, automatic) < 0.04
    assert (by_hand.gait.argmax(axis=1) == automatic.gait.argmax(axis=1)).mean() >= 0.92
    first = 2.0 if name in FERRE else 0.0
    ours, theirs = matched(by_hand, automatic, first, len(by_hand))
    assert [foot for _, foot in ours] == [foot for _, foot in theirs]
    for (a, _), (b, _) in zip(ours, theirs, strict=True):
        assert abs(a - b) < 17
    assert automatic.phase_known[by_hand.phase_known].mean() > 0.9


WALKS = [
    "07_01",
    "07_12",
    "08_05",
    "09_12",
    "16_25",
    "03_02",
    "105_10",
    "105_16",
    "105_22",
    "105_25",
    "105_31",
]
RUNS = ["02_03", "09_01", "16_36", "16_45"]


@pytest.mark.shared
@pytest.mark.parametrize("name", WALKS + RUNS)
def test_a_walk_has_a_foot_on_the_ground_and_a_run_has_both_in_the_air(shared: Path, read, name):
    """Without a given gait: walks, brisk walks, limps, a walk on rough ground, and runs."""
    clip, motion = read(shared / "mocap/cmu" / f"{name}.bvh")
    labels, _ = label_clip(clip, [], motion, None, "rocky", Options())
    gait = labels.gait.argmax(axis=1)
    left, right = labels.contacts[:, :2].any(axis=1), labels.contacts[:, 2:].any(axis=1)
    if name in RUNS:
        assert (gait == JOG).all()
        assert (~left & ~right).mean() > 0.25
        assert not (left & right).any()
        return
    walking = gait == WALK
    assert walking.mean() > 0.6
    assert not (gait == JOG).any()
    assert (left | right)[walking].mean() > 0.975  # over all walks of `cmu` it is .99
    for down in (left, right):
        assert 0.35 < down[walking].mean() < 0.85


@pytest.mark.shared
def test_labels_equal_those_of_the_original_rows(shared: Path, read, options):
    """Cycles, phase, phase change, contacts and gaits of the original generator, exactly."""
    rows = np.load(shared / "reference/original_rows_LocomotionFlat09_000.npz")
    labels, _ = both_ways(read, shared / "mocap" / f"{PFNN[1]}.bvh", options, "flat")
    assert (labels.cycles[:, 1] - labels.cycles[:, 0] + 1).tolist() == rows["cycle_length"].tolist()
    frames = np.concatenate([np.arange(a, b + 1) for a, b in labels.cycles])
    phase = labels.phase[frames].copy()
    ends = np.cumsum(rows["cycle_length"])
    phase[ends - rows["cycle_length"]], phase[ends - 1] = 0.0, 1.0
    assert phase == pytest.approx(rows["P"], abs=1e-6)
    change = np.diff(labels.phase)
    change[change < 0] += 1
    assert change[frames] == pytest.approx(rows["Y"][:, 3], abs=1e-6)
    assert (labels.contacts[frames] == (rows["Y"][:, 4:8] > 0.5)).all()
    window = labels.gait[frames[:, None] + np.arange(-60, 60, 10)]
    assert window.transpose(0, 2, 1).reshape(len(frames), 72) == pytest.approx(rows["X"][:, 48:120], abs=1e-6)


@pytest.mark.shared
def test_a_mirrored_clip_has_the_phase_of_the_release(shared: Path, read, options):
    stem = shared / "mocap" / PFNN[1]
    clip, motion = read(stem.with_suffix(".bvh"))
    files = [f"{stem}{s}" for s in SUFFIXES]
    labels, report = label_clip(clip, files, motion, None, "flat", options)
    mirrored, _ = mirror_labels(labels, report, clip)
    assert (mirrored.contacts == labels.contacts[:, [2, 3, 0, 1]]).all()
    assert (mirrored.gait == labels.gait).all()
    theirs = np.loadtxt(f"{stem}_mirror.phase")[::2]
    frames = np.concatenate([np.arange(a + 1, b) for a, b in mirrored.cycles])
    frames = frames[theirs[frames] > 0]
    assert len(frames) > 450
    assert mirrored.phase[frames] == pytest.approx(theirs[frames], abs=1e-5)
