"""Finds which way is up, the handedness of the coordinates and where the rest pose faces, and corrects them.

Hobble's clips are right-handed with Y up. Their rest poses face +Z, with the left at +X.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, rest_positions

# Factors that negate x: FLIP of a position (3,), and MIRROR of a rotation (a quaternion, (4,)).
FLIP = np.array([-1.0, 1.0, 1.0])
MIRROR = np.array([1.0, 1.0, -1.0, -1.0])
CLIMB = 20.0  # cm: a body climbs if its lowest joint rises by more than this during the clip
# A rest pose whose axes are all within 20 degrees of coordinate axes counts as exactly along these.
UPRIGHT = np.cos(np.radians(20.0))
DIRECTIONS = {  # name of an axis, such as "-X" -> (3,) unit vector
    sign + axis: np.eye(3)["XYZ".index(axis)] * (1 if sign == "+" else -1) for sign in "+-" for axis in "XYZ"
}


@dataclass(frozen=True)
class RigAxes:
    """The axes of a file's coordinates, found or given.

    up: the axis that points up, such as "+Y". handedness: "right" or "left". facing: the axis along which the
    rest pose faces, or "oblique" if it faces along none.
    """

    up: str
    handedness: str
    facing: str


def nearest_axis(direction: Array) -> tuple[str, float]:
    """The axis nearest to a direction (3,), such as "+Y", and the cosine of the angle to it."""
    unit = direction / max(float(np.linalg.norm(direction)), 1e-9)
    k = int(np.argmax(np.abs(unit)))
    return ("+" if unit[k] > 0 else "-") + "XYZ"[k], float(abs(unit[k]))


def body_axes(skeleton: Skeleton, positions: Array) -> tuple[Array, Array, Array]:
    """Unit vectors (..., 3): from right to left, from hips to head, and forward.

    Forward is where the feet point or, on a rig without toes, the knees. positions: (..., J, 3) of the
    joints.
    """
    at = {role: positions[..., skeleton.role(role), :] for role in skeleton.roles}
    left = at["left_hip"] - at["right_hip"] + at["left_shoulder"] - at["right_shoulder"]
    up = at["head"] - at["hips"]
    ahead = _foot(at, "left") + _foot(at, "right")
    return _unit(left), _unit(up), _unit(ahead)


def _foot(at: dict[str, Array], side: str) -> Array:
    """(..., 3) direction in which a foot points or, on a rig without toes, the knee of that leg.

    at: role -> (..., 3) positions.
    """
    if f"{side}_toe" in at:
        return at[f"{side}_toe"] - at[f"{side}_heel"]
    hip, knee, heel = (at[f"{side}_{part}"] for part in ("hip", "knee", "heel"))
    line = _unit(heel - hip)
    return knee - hip - line * np.sum((knee - hip) * line, axis=-1, keepdims=True)


def _unit(v: Array) -> Array:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9)


def rest_frame(skeleton: Skeleton) -> Array:
    """(4,) rotation from the axes left = X, up = Y, forward = Z to the body's own axes in the rest pose."""
    left, up, _ = body_axes(skeleton, rest_positions(skeleton))
    up = _unit(up - left * (up @ left))
    axes = np.stack([left, up, np.cross(left, up)], axis=1)
    snapped = np.round(axes)
    if np.all(np.abs(snapped).sum(axis=0) == 1) and np.sum(axes * snapped, axis=0).min() > UPRIGHT:
        axes = snapped
    return quat.from_matrix(axes)


@dataclass(frozen=True)
class UprightClip:
    """A clip with right-handed coordinates and Y up.

    axes: those of the file. If motion and rest pose disagree on what is up, a sentence says so: in `notes` if
    the figure crawls or moves far over the ground, which decides it, and else in `unsure`. At least one of
    the two lists is empty.
    """

    clip: Clip
    axes: RigAxes
    notes: list[str]
    unsure: list[str]


def straighten(clip: Clip, up: str, handedness: str, standing: bool = True) -> UprightClip:
    """The clip with right-handed coordinates and Y up.

    A rest pose that faces along an axis is turned to +Z. One that faces obliquely is left as it is.

    up: "auto", "Y" or "Z". handedness: "auto", "right" or "left". With "auto" the axes come from the motion.
    Up is then from the feet over the hips to the head, unless the figure crawls: then up is where the rest
    pose has it. standing: whether a person can stand in the rest pose; if not, it does not show what is up.

    Raises ValueError if the figure crawls and nobody can stand in the rest pose.
    """
    name, notes, unsure = _up_of(clip, standing) if up == "auto" else (f"+{up}", [], [])
    if handedness == "auto":
        handedness = _hand_of(clip)
    if handedness == "left":
        clip = _other_hand(clip)
        name = {"+X": "-X", "-X": "+X"}.get(name, name)
    world = quat.between(DIRECTIONS[name], DIRECTIONS["+Y"])
    rest = rest_frame(clip.skeleton)
    facing, near = nearest_axis(quat.rotate(rest, np.array([0.0, 0.0, 1.0])))
    turn = quat.inv(rest) if near > 1 - 1e-9 else quat.IDENTITY
    axes = RigAxes(name, handedness, facing if near > 1 - 1e-9 else "oblique")
    return UprightClip(_turned(clip, world, turn), axes, notes, unsure)


def _up_of(clip: Clip, standing: bool) -> tuple[str, list[str], list[str]]:
    """The axis that is up, and the lists `notes` and `unsure` of `UprightClip`."""
    body, rest = (
        nearest_axis(_along_body(clip.skeleton, positions).mean(axis=0))[0]
        for positions in (clip.positions, rest_positions(clip.skeleton)[None])
    )
    crawls = _crawls(clip, body)
    if not standing and crawls:
        why = (
            f"the body moves along {body}, from its feet to its head, and nobody could stand in its zero pose"
        )
        raise ValueError(why)
    if body == rest or not standing:
        return body, [], []
    up, why = (rest, "the body crawls") if crawls else (body, "the body moves that way up")
    note = (
        f"The body lies along {body} and its rest pose along {rest}. {up} was taken for up, because {why} "
        "(motion.up overrides this)."
    )
    return (up, [note], []) if crawls or _travels(clip, body) else (up, [], [note])


def _along_body(skeleton: Skeleton, positions: Array) -> Array:
    """(F, 3) sum of the unit vectors from the feet to the hips and from the hips to the head.

    positions: (F, J, 3).
    """
    feet = [f"{side}_{part}" for side in ("left", "right") for part in ("toe", "heel")]
    feet = [next(role for role in feet[i : i + 2] if role in skeleton.roles) for i in (0, 2)]
    head, hips, left, right = (positions[:, skeleton.role(name)] for name in ("head", "hips", *feet))
    return _unit(head - hips) + _unit(hips - 0.5 * (left + right))


def _crawls(clip: Clip, axis: str) -> bool:
    """Whether the body moves at least about as far along `axis`, from its feet to its head, as across it.

    An upright figure that did this would be climbing, but upright figures climb less far than they move over
    the ground. A jump does not count, because the lowest joint comes down again.
    """
    along = clip.positions @ DIRECTIONS[axis]
    early, late = np.percentile(along.min(axis=1), [25, 75])
    travel = np.ptp(clip.root, axis=0)
    return bool(late - early > CLIMB and travel @ np.abs(DIRECTIONS[axis]) >= 0.9 * travel.max())


def _travels(clip: Clip, axis: str) -> bool:
    """Whether the figure moves further over the ground than it is tall, if `axis` points up."""
    along, level = DIRECTIONS[axis], 1 - np.abs(DIRECTIONS[axis])
    tall = float(np.median(np.ptp(clip.positions @ along, axis=1)))
    return bool(np.linalg.norm(np.ptp(clip.root * level, axis=0)) > tall)


def _hand_of(clip: Clip) -> str:
    left, up, feet = body_axes(clip.skeleton, clip.positions)
    return "left" if np.mean(np.sum(np.cross(left, up) * feet, axis=-1)) < -0.2 else "right"


def _other_hand(clip: Clip) -> Clip:
    """The clip with x negated, which changes left-handed to right-handed coordinates."""
    ends = {name: (-x, y, z) for name, (x, y, z) in clip.skeleton.end_sites.items()}
    return replace(
        clip,
        skeleton=replace(clip.skeleton, offsets=clip.skeleton.offsets * FLIP, end_sites=ends),
        rotations=clip.rotations * MIRROR,
        root=clip.root * FLIP,
        translations=None if clip.translations is None else clip.translations * FLIP,
    )


def _turned(clip: Clip, world: Array, rest: Array) -> Clip:
    """The clip with its world turned by `world` (4,), and its rest pose turned by `rest` (4,).

    Turning the rest pose moves no joint of the motion.
    """
    if np.allclose(world, quat.IDENTITY) and np.allclose(rest, quat.IDENTITY):
        return clip
    rotations = quat.mul(quat.mul(rest, clip.rotations), quat.inv(rest))
    rotations[:, 0] = quat.mul(quat.mul(world, clip.rotations[:, 0]), quat.inv(rest))
    ends = {
        name: (float(x), float(y), float(z))
        for name, offset in clip.skeleton.end_sites.items()
        for x, y, z in [quat.rotate(rest, np.array(offset))]
    }
    offsets = quat.rotate(rest, clip.skeleton.offsets)
    return replace(
        clip,
        skeleton=replace(clip.skeleton, offsets=offsets, end_sites=ends),
        rotations=rotations,
        root=quat.rotate(world, clip.root),
        translations=None if clip.translations is None else quat.rotate(rest, clip.translations),
    )


def turned(clip: Clip, angle: float) -> Clip:
    """The clip turned about the vertical through its first root position.

    angle: radians, positive from +Z towards +X.
    """
    turn = quat.yaw(angle)
    rotations = clip.rotations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    start = clip.root[0] * [1, 0, 1]
    return replace(clip, rotations=rotations, root=quat.rotate(turn, clip.root - start) + start)
