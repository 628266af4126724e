"""Checks that retargeting kept the motion: compares joint angles and limbs of source and result."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.motion.body import SIDES

MOST = 15.0  # degrees: a result whose joint or limb differs more than this on average is refused
# Joint -> three roles. The angle is the one between the bone from the first to the second and the bone from
# the second to the third: 0 if they are in line.
ANGLES = {
    "knee": ("hip", "knee", "heel"),
    "elbow": ("shoulder", "elbow", "wrist"),
    "hip": ("head", "hip", "knee"),
    "ankle": ("knee", "heel", "toe"),
}
BONES = {  # limb -> roles of its two ends
    "thigh": ("hip", "knee"),
    "shank": ("knee", "heel"),
    "upper arm": ("shoulder", "elbow"),
    "forearm": ("elbow", "wrist"),
}
# In the same pose, bodies of different shapes have different angles at these joints: a nearly straight knee
# bends 15 degrees more if the leg is 1.5 cm longer and hip and ankle stay where they are. So the median
# difference is subtracted before these angles are compared.
SHAPED = ("hip", "ankle", "knee")
OFFSET = 25.0  # degrees: a larger constant difference of a knee is an error and is not subtracted
STANDS = 0.6  # cm a frame at 60 Hz: the ball of a standing foot is slower than this
# Least mean cosine of the angle between where a bent knee points and where the trunk faces. In 172 clips of
# the data sets `cmu`, `styles` and `patients`, of Ferre et al. and of Holden et al. (2017) it is .57 or more.
KNEE_AHEAD = 0.25
BENT = 20.0  # degrees: a knee that bends less does not show where it points


def compare(source: Clip, result: Clip, scale: float) -> dict[str, Any]:
    """How much the result of retargeting differs from its source, frame by frame.

    scale: leg length of the result / leg length of the source.

    angles: "left knee" -> 5th, 50th and 95th percentile of the angle in `source` and in `result`; `constant`,
    the median difference (0 for joints not in SHAPED); and `apart`, the mean difference after `constant` is
    subtracted (except for a knee whose `constant` is OFFSET or more). directions: "left thigh" -> mean angle
    between the thigh's directions in source and result. feet: side -> how much `higher` the ball is in the
    result, in cm, and how fast it slides over the ground in source and result while it stands, in cm a
    second (`slide_source`, `slide_result`). knees: side -> mean cosine of the angle between where the
    result's bent knee points and where its body faces, or None for a knee that hardly bends.
    """
    frames = min(len(source), len(result))
    before, after = (_places(clip, frames) for clip in (source, result))
    return {
        "angles": {f"{s} {name}": _angle(before, after, s, name) for s in SIDES for name in ANGLES},
        "directions": {f"{s} {name}": _direction(before, after, s, name) for s in SIDES for name in BONES},
        "feet": {s: _foot(before, after, s, scale, result.fps) for s in SIDES},
        "knees": {s: _forward(after, s) for s in SIDES},
    }


def check(path: Path, differences: dict[str, Any], rig: str) -> None:
    """Raise InputError if a result does not move like its source.

    The error names the joint or limb that differs most. path: of the source. differences: what `compare`
    returns. rig: name of the source's rig.
    """
    name, degrees = worst(differences)
    look = (
        f"Look at it (`python -m hobble.motion look {path} --picture apart.svg` draws it beside its source), "
        f"and correct the roles of its rig. `python -m hobble.motion rig {path}` writes a draft for "
        "config/skeletons/."
    )
    if degrees > MOST:
        raise InputError(
            path, f"the {name} is {degrees:.0f} degrees off its source on average (rig: {rig})", fix=look
        )
    backward = [side for side, ahead in differences["knees"].items() if ahead is not None and ahead < -0.3]
    if len(backward) == 2:
        raise InputError(path, f"both knees bend backward (rig: {rig})", fix=look)


def check_knees(path: Path, clip: Clip, leave: bool) -> None:
    """Raise InputError if a bent knee does not point forward. leave: accept it nevertheless."""
    at = _places(clip, len(clip))
    for side in SIDES:
        ahead = _forward(at, side, at["head"] - at["hips"])
        if ahead is not None and ahead < KNEE_AHEAD and not leave:
            raise InputError(
                path,
                f"the {side} knee bends {np.degrees(np.arccos(ahead)):.0f} degrees away from forward on "
                "average, so the rotation channels may be declared in another order than they were written",
                fix="Export the clip again, or set motion.defects: leave to take it as it is.",
            )


def worst(differences: dict[str, Any]) -> tuple[str, float]:
    """The joint or limb that differs most, and by how many degrees on average.

    differences: what `compare` returns.
    """
    apart = {name: each["apart"] for name, each in differences["angles"].items()} | differences["directions"]
    name = max(apart, key=lambda part: apart[part])
    return name, apart[name]


def _places(clip: Clip, frames: int) -> dict[str, Array]:
    return {role: clip.positions[:frames, clip.skeleton.role(role)] for role in clip.skeleton.roles}


def _angle(before: dict[str, Array], after: dict[str, Array], side: str, name: str) -> dict[str, Any]:
    source, result = (_bend(at, side, ANGLES[name]) for at in (before, after))
    off = result - source
    constant = float(np.median(off)) if name in SHAPED else 0.0
    off = off - (constant if name != "knee" or abs(constant) < OFFSET else 0.0)
    return {
        "source": [round(float(x), 1) for x in np.percentile(source, [5, 50, 95])],
        "result": [round(float(x), 1) for x in np.percentile(result, [5, 50, 95])],
        "constant": round(constant, 2),
        "apart": round(float(np.abs(off).mean()), 2),
    }


def _bend(at: dict[str, Array], side: str, parts: tuple[str, ...]) -> Array:
    """(F,) degrees between the two bones that connect three joints: 0 if the bones are in line."""
    a, b, c = (at[part] if part == "head" else at[f"{side}_{part}"] for part in parts)
    return np.degrees(np.arccos(np.clip(np.sum(_unit(b - a) * _unit(c - b), axis=-1), -1.0, 1.0)))


def _direction(before: dict[str, Array], after: dict[str, Array], side: str, name: str) -> float:
    start, end = (f"{side}_{part}" for part in BONES[name])
    one, other = (_unit(at[end] - at[start]) for at in (before, after))
    return round(float(np.degrees(np.arccos(np.clip(np.sum(one * other, axis=-1), -1.0, 1.0))).mean()), 2)


def _foot(
    before: dict[str, Array], after: dict[str, Array], side: str, scale: float, fps: float
) -> dict[str, float | None]:
    one, other = before[f"{side}_toe"] * scale, after[f"{side}_toe"]
    speeds = [np.linalg.norm(np.diff(at[:, [0, 2]], axis=0), axis=-1) for at in (one, other)]
    stance = np.linalg.norm(np.diff(one, axis=0), axis=-1) * fps / 60.0 < STANDS
    slides = [round(float(speed[stance].mean() * fps), 2) if stance.any() else None for speed in speeds]
    return {
        "higher": round(float(np.mean(other[:, 1] - one[:, 1])), 2),
        "slide_source": slides[0],
        "slide_result": slides[1],
    }


def _forward(
    at: dict[str, Array], side: str, up: Array | tuple[float, ...] = (0.0, 1.0, 0.0)
) -> float | None:
    """Mean cosine of the angle between where a knee points and where the body faces, while the knee is bent.

    None if the knee is bent in less than a tenth of the frames. up: (3,) or (F, 3), up along the body.
    """
    ahead = _unit(np.cross(at["left_hip"] - at["right_hip"], up))
    hip, knee, heel = (at[f"{side}_{part}"] for part in ("hip", "knee", "heel"))
    bent = _bend(at, side, ANGLES["knee"]) > BENT
    if bent.mean() < 0.1:
        return None
    line = _unit(heel - hip)
    out = knee - hip - line * np.sum((knee - hip) * line, axis=-1, keepdims=True)
    return round(float(np.mean(np.sum(_unit(out[bent]) * ahead[bent], axis=-1))), 2)


def _unit(v: Array) -> Array:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9)
