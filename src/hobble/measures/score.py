"""Scores a folder of BVH files: how clean the motion is, and how near to captured motion."""

import argparse
import json
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from hobble.core.clip import Clip
from hobble.core.clip_files import clips_in
from hobble.core.errors import HobbleError, InputError
from hobble.core.files import atomic_path, write_json
from hobble.core.quat import Array
from hobble.labels.clip_labels import GAITS
from hobble.labels.footfall import find_stance_contacts
from hobble.labels.gait import automatic_gait
from hobble.measures import motion_quality as quality
from hobble.measures.motion_quality import FOOT_POINTS, FPS, joints_with
from hobble.motion import ClipMotion
from hobble.motion.edit import resample
from hobble.motion.make import load_source
from hobble.motion.read import read_bvh
from hobble.motion.skeleton_file import KnownSkeleton, find_skeleton, load_skeleton, skeleton_folder

SKELETON = "holden31"  # its roles, such as hips and left heel, are looked for in each file
SHORTEST = 1.0  # seconds; shorter clips are left out
# Measure of a clip -> its name on paper and its unit. More of each of them is worse, but for the joints'
# rotation, where too little is stiff.
OF_CLIP = {
    "skating": ("foot skating", "cm a frame"),
    "floor": ("feet too high or too low", "cm"),
    "floating": ("floating", "cm"),
    "depth": ("feet below the ground", "cm"),
    "deep_share": ("frames with a foot 1 cm deep", "share"),
    "jerk": ("jerk", "m/s3"),
    "joint_update": ("rotation of joints", "degrees a frame"),
    "contact_speed": ("speed of feet on the ground", "share of their largest"),
}
OF_FOLDER = {
    "frechet": ("Frechet distance to the reference", "variance of the reference"),
    "diversity": ("diversity of windows", "spread of the reference"),
    "gaits": ("variety of gaits", "gaits, by entropy"),
}
# A clip's measure is marked in the picture if it is more than this many times the reference's median.
MARKED = 1.5


@dataclass(frozen=True)
class Take:
    """A clip to score, at 60 frames a second. rig: joint names and bone lengths, which tell rigs apart."""

    clip: Clip
    rig: tuple[Any, ...] = field(repr=False)
    feet: Array = field(repr=False)

    @cached_property
    def standing(self) -> Array:
        """(4,) heights at which the points of its feet stand, cm."""
        return quality.standing_heights(self.feet)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `hobble score`."""
    add = parser.add_argument
    add("folder", type=Path, help="a folder of BVH files, or one file")
    add("--reference", type=Path, help="a folder of captured BVH files to compare with")
    add("--out", type=Path, help="the folder for score.json and score.png")
    add("--json", action="store_true", help="print JSON instead of a table")
    add("--source-fps", type=float, help="frame rate of the files of FOLDER, if their Frame Time is wrong")


def run(options: argparse.Namespace) -> int:
    """Score the motion in BVH files: skating, floating, sinking, jerk, nearness to captured motion.

    hobble score FOLDER
    hobble score FOLDER --reference CAPTURED --out scores

    No training and no engine is needed. Files may have any rig, unit, axes and frame rate. They are measured
    as they are: nothing is repaired or retargeted, and the ground is at height 0. With --reference, a folder
    of captured motion, each value stands beside the reference's. Then the motion is also compared in windows
    of one second: their Frechet distance (0: the same distribution, 1: as far away as the reference is
    spread), beside that of two halves of the reference, and their diversity. --out writes score.json and
    score.png. docs/scores.md has the formulas and their sources.
    """
    takes, failed = load_takes(options.folder, options.source_fps)
    reference = load_takes(options.reference, None) if options.reference else None
    result = score(takes, reference[0] if reference else None)
    result["failed"] = {**failed, **(reference[1] if reference else {})}
    print(json.dumps(result, indent=1) if options.json else as_table(result))
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        write_json(options.out / "score.json", result)
        draw(options.out / "score.png", result)
    return 1 if result["failed"] else 0


def load_takes(folder: Path, source_fps: float | None) -> tuple[list[Take], dict[str, str]]:
    """The clips of a folder, and file -> message for those that cannot be read or are too short.

    Raises InputError if no clip is left.
    """
    takes, failed, roles = [], dict[str, str](), load_skeleton(find_skeleton(SKELETON))
    files = tqdm(clips_in(folder).items(), unit=" clips", disable=None, file=sys.stderr, leave=False)
    for name, file in files:
        try:
            takes.append(load_take(name, file, roles, source_fps))
        except HobbleError as error:
            failed[str(file)] = str(error)
            files.write(str(error), file=sys.stderr)
    if not takes:
        raise InputError(folder, "has no clip that can be scored", fix="See the messages above.")
    return takes, failed


def load_take(name: str, file: Path, roles: KnownSkeleton, source_fps: float | None) -> Take:
    """A clip as it is, in cm, Y up, at 60 frames a second, on its own rig. InputError for a bad file.

    roles: a skeleton whose roles are looked for in the file.
    """
    # `leave` and `rocky`: what is wrong with the motion and with its height must not be mended.
    options = ClipMotion(source_fps=source_fps, defects="leave", ground="rocky", accept_doubt=True)
    source = load_source(read_bvh(file), roles, skeleton_folder(), options)
    clip = resample(source.clip, FPS)
    if len(clip) < SHORTEST * FPS:
        raise InputError(
            file, f"lasts {len(clip) / FPS:.2f} s", fix=f"Clips of {SHORTEST:g} s or more count."
        )
    skeleton = clip.skeleton
    rig = (skeleton.joints, tuple(np.linalg.norm(skeleton.offsets, axis=1).round(1)))
    return Take(replace(clip, name=name), rig, clip.positions[:, joints_with(skeleton, FOOT_POINTS)])


def score(takes: Sequence[Take], reference: Sequence[Take] | None = None) -> dict[str, Any]:
    """The scores of takes, which must not be empty. The content of score.json (docs/artefacts.md).

    Feet skate, float and sink relative to the height at which they stand in their clip. `floor` says how far
    this height is from that of the reference's clips with the same rig, or of the takes, if there are none.
    """
    ground = _standing(takes) | (_standing(reference) if reference else {})
    gaits = _gaits(takes)
    result: dict[str, Any] = {
        "clips": {take.clip.name: _of_clip(take, ground[take.rig]) for take in takes},
        "gaits": gaits,
    }
    result["mean"] = _mean(result["clips"].values()) | {"gaits": _variety(gaits)}
    if reference:
        clips = [_of_clip(take, ground[take.rig]) for take in reference]
        result["reference"] = _mean(clips) | {"gaits": _variety(_gaits(reference))}
        result["reference_median"] = {
            name: float(np.nanmedian(np.abs([clip[name] for clip in clips]))) for name in OF_CLIP
        }
        features = _features(reference)
        # Two halves: blocks of ten windows in turn, so that both halves have all clips of the reference.
        half = np.arange(len(features)) // 10 % 2 == 0
        mine, theirs = quality.compare_windows(_features(takes), features, half)
        result["mean"] |= mine
        result["reference"] |= theirs
    return result


def _standing(takes: Sequence[Take]) -> dict[tuple[Any, ...], Array]:
    """Rig -> (4,) heights of its standing feet, the median over its clips."""
    of_rig: dict[tuple[Any, ...], list[Array]] = {}
    for take in takes:
        of_rig.setdefault(take.rig, []).append(take.standing)
    return {rig: np.median(heights, axis=0) for rig, heights in of_rig.items()}


def _of_clip(take: Take, ground: Array) -> dict[str, float]:
    """The measures OF_CLIP of one clip, and its seconds. ground: (4,) heights of standing feet of its rig."""
    depth, deep_share = quality.penetration(take.feet, take.standing)
    found = quality.cleanness(take.clip.skeleton, take.clip.positions, take.clip.rotations)
    found |= {
        "seconds": len(take.clip) / FPS,
        "floor": float((take.standing - ground).mean()),
        "floating": quality.floating(take.feet, take.standing),
        "depth": depth,
        "deep_share": deep_share,
    }
    return {key: found[key] for key in ("seconds", *OF_CLIP)}


def _mean(clips: Any) -> dict[str, float]:
    """Mean size of each measure over clips, weighted by their seconds."""
    clips = list(clips)
    out = {}
    for name in OF_CLIP:
        values, seconds = (np.array([clip[key] for clip in clips]) for key in (name, "seconds"))
        known, values = np.isfinite(values), np.abs(values)
        out[name] = float(np.average(values[known], weights=seconds[known])) if known.any() else math.nan
    return out


def _features(takes: Sequence[Take]) -> Array:
    """(N, D) windows of all takes."""
    return np.concatenate([quality.window_features(t.clip.skeleton, t.clip.positions) for t in takes])


def _gaits(takes: Sequence[Take]) -> dict[str, float]:
    """Gait -> its share of all frames, as `hobble labels` finds gaits."""
    shares = [automatic_gait(t.clip, find_stance_contacts(t.clip), None) for t in takes]
    return dict(zip(GAITS, np.concatenate(shares).mean(axis=0).round(4).tolist(), strict=True))


def _variety(shares: Mapping[str, float]) -> float:
    """How many gaits, equally frequent, would be as varied: the exponential of the entropy of the shares."""
    p = np.array([share for share in shares.values() if share > 0])
    return float(np.exp(-(p * np.log(p)).sum()))


def as_table(result: Mapping[str, Any]) -> str:
    """The scores as lines of text: each measure, beside the reference's if there is one."""
    reference = result.get("reference", {})
    lines = [f"{'':36}{'score':>9}" + (f"{'reference':>12}" if reference else "")]
    for key, (name, unit) in (OF_CLIP | OF_FOLDER).items():
        if key in result["mean"]:
            beside = f"{reference[key]:12.3f}" if key in reference else ""
            lines.append(f"{name:36}{result['mean'][key]:9.3f}{beside}  {unit}")
    if reference:
        lines.append("The reference's Frechet distance is that of two halves of it.")
    for key in ("skating", "jerk"):
        worst = max(result["clips"], key=lambda clip: result["clips"][clip][key])
        lines.append(f"Most {OF_CLIP[key][0]}: {worst}, {result['clips'][worst][key]:.3f} {OF_CLIP[key][1]}.")
    count, failed = len(result["clips"]), len(result.get("failed", {}))
    return "\n".join(
        [*lines, f"{count} clips scored" + (f", {failed} left out: see above" if failed else "")]
    )


def draw(path: Path, result: Mapping[str, Any]) -> None:
    """A picture of the clips' scores, one panel for each measure, the reference's median as a line."""
    from matplotlib.figure import Figure  # here, because the import takes half a second

    names = list(result["clips"])
    figure = Figure(figsize=(2.2 * len(OF_CLIP), 1.2 + 0.16 * max(len(names), 6)), layout="constrained")
    for at, (key, (title, unit)) in enumerate(OF_CLIP.items()):
        axes = figure.add_subplot(1, len(OF_CLIP), at + 1)
        values = np.array([result["clips"][name][key] for name in names])
        median = result.get("reference_median", {}).get(key)
        bad = np.abs(values) > MARKED * median if median is not None else np.zeros(len(values), bool)
        axes.barh(range(len(names)), values, color=np.where(bad, "#c0392b", "#7f8c8d"))
        if median is not None:
            axes.axvline(median, color="black", linewidth=1)
        axes.set_yticks(range(len(names)), names if at == 0 else [""] * len(names), fontsize=6)
        axes.invert_yaxis()
        axes.set_title(f"{title}\n{unit}", fontsize=7)
        axes.tick_params(axis="x", labelsize=6)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format="png", dpi=150)
