"""Checks that retargeting kept the motion.

It compares the joint angles, limbs and feet of the source clip with those of the result. A role, such as
left_knee, names a part of the body. Each skeleton tells which of its joints has which role.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.motion.body import SIDES

# Degrees: a result is refused if one of its joints or limbs differs by more than this on average.
MOST_DIFFERENCE = 15.0
# Joint -> three roles, without "left_" or "right_". The joint's angle is the one between the bone from the
# first to the second and the bone from the second to the third: 0 if these bones are in line.
ANGLES = {
    "knee": ("hip", "knee", "heel"),
    "elbow": ("shoulder", "elbow", "wrist"),
    "hip": ("head", "hip", "knee"),
    "ankle": ("knee", "heel", "toe"),
}
BONES = {  # limb -> roles of its two ends, without the side
    "thigh": ("hip", "knee"),
    "shank": ("knee", "heel"),
    "upper arm": ("shoulder", "elbow"),
    "forearm": ("elbow", "wrist"),
}
# In the same pose, bodies of different shapes have different angles at these joints: a nearly straight knee
# bends 15 degrees more if the leg is 1.5 cm longer and hip and ankle stay where they are. So the median
# difference is subtracted before these angles are compared.
SHAPE_DEPENDENT = ("hip", "ankle", "knee")
MOST_OF_KNEE = 25.0  # degrees: a larger median difference of a knee is an error and is not subtracted
STANCE_SPEED = 0.6  # cm a frame at 60 Hz: the ball of a standing foot is slower than this
# A clip is refused if the mean cosine of the angle between where a bent knee points and where the body faces
# is less than this. In 172 clips of the data sets `cmu`, `styles` and `patients`, of Ferre et al. and of
# Holden et al. (2017), it is 0.57 or more.
KNEE_AHEAD = 0.25
KNEE_BACKWARD = -0.3  # a knee bends backward if the same cosine is less than this
BENT = 20.0  # degrees: a knee that bends less does not show where it points


def compare_motions(source: Clip, result: Clip, scale: float) -> dict[str, Any]:
    """How much the result of retargeting differs from its source, frame by frame.

    scale: leg length of the result / leg length of the source.

    Returns a dictionary with these keys. All angles are in degrees.

    angles: joint, such as "left knee" -> dictionary. `source` and `result` are the 5th, 50th and 95th
    percentile of the joint's angle in each clip. `constant` is the median difference, or 0 for joints not in
    SHAPE_DEPENDENT. `apart` is the mean absolute difference after `constant` is subtracted; the `constant` of
    a knee is not subtracted if it is MOST_OF_KNEE or more.

    directions: limb, such as "left thigh" -> mean angle between its directions in source and result.

    feet: side -> dictionary. The source's positions are multiplied by `scale` for it. `higher` is how many cm
    higher the ball of the foot is in the result than in the source, on average. `slide_source` and
    `slide_result` are its mean speeds over the ground while the source's foot stands, cm a second, or None if
    that foot never stands.

    knees: side -> mean cosine of the angle between where the result's bent knee points and where its body
    faces, or None for a knee that hardly bends.
    """
    frames = min(len(source), len(result))
    source_at, result_at = (_positions_by_role(clip, frames) for clip in (source, result))
    return {
        "angles": {
            f"{s} {name}": _compare_angle(source_at, result_at, s, name) for s in SIDES for name in ANGLES
        },
        "directions": {
            f"{s} {name}": _compare_direction(source_at, result_at, s, name) for s in SIDES for name in BONES
        },
        "feet": {s: _compare_foot(source_at, result_at, s, scale, result.fps) for s in SIDES},
        "knees": {s: _knee_cosine(result_at, s) for s in SIDES},
    }


def check_difference(path: Path, differences: dict[str, Any], rig: str) -> None:
    """Raise InputError if a result does not move like its source.

    The error names the joint or limb that differs most. path: the source's file. differences: what
    `compare_motions` returns. rig: name of the source's rig.
    """
    name, degrees = most_different(differences)
    fix = (
        f"Look at both (`python -m hobble.motion look {path} --picture apart.svg` draws them side by side), "
        f"and correct the roles of its rig. `python -m hobble.motion rig {path}` writes a draft for "
        "config/skeletons/."
    )
    if degrees > MOST_DIFFERENCE:
        raise InputError(
            path, f"the {name} is {degrees:.0f} degrees off its source on average (rig: {rig})", fix=fix
        )
    cosines = differences["knees"].values()
    if sum(cosine is not None and cosine < KNEE_BACKWARD for cosine in cosines) == 2:
        raise InputError(path, f"both knees bend backward (rig: {rig})", fix=fix)


def check_knees(path: Path, clip: Clip, leave: bool) -> None:
    """Raise InputError if a bent knee does not point forward. leave: accept the clip even so."""
    at = _positions_by_role(clip, len(clip))
    for side in SIDES:
        cosine = _knee_cosine(at, side, at["head"] - at["hips"])
        if cosine is not None and cosine < KNEE_AHEAD and not leave:
            raise InputError(
                path,
                f"the {side} knee bends {np.degrees(np.arccos(cosine)):.0f} degrees away from forward on "
                "average, so the rotation channels may be declared in another order than they were written",
                fix="Export the clip again, or set motion.defects: leave to take it as it is.",
            )


def most_different(differences: dict[str, Any]) -> tuple[str, float]:
    """The joint or limb that differs most, and by how many degrees on average.

    differences: what `compare_motions` returns.
    """
    apart = {name: each["apart"] for name, each in differences["angles"].items()} | differences["directions"]
    name = max(apart, key=lambda part: apart[part])
    return name, apart[name]


def _positions_by_role(clip: Clip, frames: int) -> dict[str, Array]:
    """Role -> (frames, 3) positions of its joint, in the first frames of a clip."""
    return {role: clip.positions[:frames, clip.skeleton.role(role)] for role in clip.skeleton.roles}


def _compare_angle(
    source_at: dict[str, Array], result_at: dict[str, Array], side: str, name: str
) -> dict[str, Any]:
    """What `compare_motions` returns in `angles` for one joint.

    source_at, result_at: role -> (F, 3) positions.
    """
    source, result = (_bend(at, side, ANGLES[name]) for at in (source_at, result_at))
    difference = result - source
    constant = float(np.median(difference)) if name in SHAPE_DEPENDENT else 0.0
    difference = difference - (constant if name != "knee" or abs(constant) < MOST_OF_KNEE else 0.0)
    return {
        "source": [round(float(x), 1) for x in np.percentile(source, [5, 50, 95])],
        "result": [round(float(x), 1) for x in np.percentile(result, [5, 50, 95])],
        "constant": round(constant, 2),
        "apart": round(float(np.abs(difference).mean()), 2),
    }


def _bend(at: dict[str, Array], side: str, parts: tuple[str, ...]) -> Array:
    """(F,) degrees between the two bones that connect three joints: 0 if the bones are in line.

    at: role -> (F, 3) positions. parts: the joints' roles without the side.
    """
    a, b, c = (at[part] if part == "head" else at[f"{side}_{part}"] for part in parts)
    return np.degrees(np.arccos(np.clip(np.sum(_unit(b - a) * _unit(c - b), axis=-1), -1.0, 1.0)))


def _compare_direction(
    source_at: dict[str, Array], result_at: dict[str, Array], side: str, name: str
) -> float:
    """Mean angle, degrees, between the directions of a limb in source and result."""
    start, end = (f"{side}_{part}" for part in BONES[name])
    source, result = (_unit(at[end] - at[start]) for at in (source_at, result_at))
    cosines = np.clip(np.sum(source * result, axis=-1), -1.0, 1.0)
    return round(float(np.degrees(np.arccos(cosines)).mean()), 2)


def _compare_foot(
    source_at: dict[str, Array], result_at: dict[str, Array], side: str, scale: float, fps: float
) -> dict[str, float | None]:
    """What `compare_motions` returns in `feet` for one side."""
    source, result = source_at[f"{side}_toe"] * scale, result_at[f"{side}_toe"]
    speeds = [np.linalg.norm(np.diff(at[:, [0, 2]], axis=0), axis=-1) for at in (source, result)]
    stance = np.linalg.norm(np.diff(source, axis=0), axis=-1) * fps / 60.0 < STANCE_SPEED
    slides = [round(float(speed[stance].mean() * fps), 2) if stance.any() else None for speed in speeds]
    return {
        "higher": round(float(np.mean(result[:, 1] - source[:, 1])), 2),
        "slide_source": slides[0],
        "slide_result": slides[1],
    }


def _knee_cosine(
    at: dict[str, Array], side: str, up: Array | tuple[float, ...] = (0.0, 1.0, 0.0)
) -> float | None:
    """Mean cosine of the angle between where a knee points and where the body faces, while the knee is bent.

    None if the knee is bent in less than a tenth of the frames. at: role -> (F, 3) positions. up: (3,) or
    (F, 3), the direction up along the body.
    """
    # The body's left times its up gives its forward.
    ahead = _unit(np.cross(at["left_hip"] - at["right_hip"], up))
    hip, knee, heel = (at[f"{side}_{part}"] for part in ("hip", "knee", "heel"))
    bent = _bend(at, side, ANGLES["knee"]) > BENT
    if bent.mean() < 0.1:
        return None
    # How far the knee lies out from the straight line between hip and heel: where it points.
    leg_line = _unit(heel - hip)
    outward = knee - hip - leg_line * np.sum((knee - hip) * leg_line, axis=-1, keepdims=True)
    return round(float(np.mean(np.sum(_unit(outward[bent]) * ahead[bent], axis=-1))), 2)


def _unit(v: Array) -> Array:
    """Vectors (..., 3) of length 1."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9)
