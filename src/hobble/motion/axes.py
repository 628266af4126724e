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

# Factors that mirror at the plane x = 0: FLIP for a position (3,), MIRROR for a quaternion (4,).
FLIP = np.array([-1.0, 1.0, 1.0])
MIRROR = np.array([1.0, 1.0, -1.0, -1.0])
# cm: a figure crawls or climbs along an axis only if its lowest joint moves by more than this along the axis.
# The movement is measured between the quartiles of the joint's places.
CLIMB = 20.0
# Cosine of 20 degrees. If all axes of the body in the rest pose are within this angle of coordinate axes, the
# rest pose counts as exactly along the coordinate axes.
UPRIGHT = np.cos(np.radians(20.0))
DIRECTIONS = {  # name of an axis, such as "-X" -> (3,) unit vector
    sign + axis: np.eye(3)["XYZ".index(axis)] * (1 if sign == "+" else -1) for sign in "+-" for axis in "XYZ"
}


@dataclass(frozen=True)
class RigAxes:
    """The axes of a file's coordinates, found from the motion or set by the user.

    up: the axis that points up, such as "+Y". handedness: "right" or "left". facing: the axis along which the
    rest pose faces, or "oblique" if it faces along no axis. If the coordinates are left-handed, `up` and
    `facing` are the axes after x has been negated.
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

    Forward is the direction of the feet or, on a rig without toes, the direction in which the knees point.
    positions: (..., J, 3) of the joints.
    """
    at = {role: positions[..., skeleton.role(role), :] for role in skeleton.roles}
    left = at["left_hip"] - at["right_hip"] + at["left_shoulder"] - at["right_shoulder"]
    up = at["head"] - at["hips"]
    ahead = _foot_direction(at, "left") + _foot_direction(at, "right")
    return _unit(left), _unit(up), _unit(ahead)


def _foot_direction(at: dict[str, Array], side: str) -> Array:
    """(..., 3) vector from ankle to ball or, on a rig without toes, from the line hip to ankle to the knee.

    at: role -> (..., 3) positions.
    """
    if f"{side}_toe" in at:
        return at[f"{side}_toe"] - at[f"{side}_heel"]
    hip, knee, heel = (at[f"{side}_{part}"] for part in ("hip", "knee", "heel"))
    line = _unit(heel - hip)
    return knee - hip - line * np.sum((knee - hip) * line, axis=-1, keepdims=True)


def _unit(v: Array) -> Array:
    """Vectors (..., 3) of length 1."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9)


def rest_frame(skeleton: Skeleton) -> Array:
    """(4,) rotation that turns X to the body's left in the rest pose, Y to its up, and Z to its front."""
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

    axes: the axes of the file. notes, unsure: both are empty unless motion and rest pose disagree on which
    axis is up. Then one sentence says so. It is in `notes` if the motion is clear, because the figure crawls
    or moves far over the ground. Otherwise it is in `unsure`.
    """

    clip: Clip
    axes: RigAxes
    notes: list[str]
    unsure: list[str]


def straighten(clip: Clip, up: str, handedness: str, standing: bool = True) -> UprightClip:
    """The clip with right-handed coordinates and Y up.

    A rest pose that faces along an axis is turned to +Z. An oblique rest pose is left as it is.

    up: "auto", "Y" or "Z". handedness: "auto", "right" or "left". With "auto", the axes are found from the
    motion. Up is then the axis nearest to the line from the feet over the hips to the head. If the figure
    crawls, this line in the rest pose is used. standing: whether a person can stand in the rest pose. If not,
    the rest pose does not show which axis is up.

    Raises ValueError with up = "auto" if the figure crawls and nobody can stand in the rest pose.
    """
    up_axis, notes, unsure = _up_axis(clip, standing) if up == "auto" else (f"+{up}", [], [])
    if handedness == "auto":
        handedness = _handedness_of(clip)
    if handedness == "left":
        clip = _with_x_negated(clip)
        up_axis = {"+X": "-X", "-X": "+X"}.get(up_axis, up_axis)
    world = quat.between(DIRECTIONS[up_axis], DIRECTIONS["+Y"])
    rest = rest_frame(clip.skeleton)
    facing, cosine = nearest_axis(quat.rotate(rest, np.array([0.0, 0.0, 1.0])))
    along_axis = cosine > 1 - 1e-9
    turn = quat.inv(rest) if along_axis else quat.IDENTITY
    axes = RigAxes(up_axis, handedness, facing if along_axis else "oblique")
    return UprightClip(_with_world_and_rest_turned(clip, world, turn), axes, notes, unsure)


def _up_axis(clip: Clip, standing: bool) -> tuple[str, list[str], list[str]]:
    """The axis that points up, and the lists `notes` and `unsure` of `UprightClip`."""
    # The axes nearest to the line from feet to head, in the motion and in the rest pose.
    in_motion, in_rest = (
        nearest_axis(_along_body(clip.skeleton, positions).mean(axis=0))[0]
        for positions in (clip.positions, rest_positions(clip.skeleton)[None])
    )
    crawls = _crawls(clip, in_motion)
    if not standing and crawls:
        why = (
            f"the body moves along the line from its feet to its head ({in_motion}) as if it crawled, and "
            "nobody could stand in its zero pose"
        )
        raise ValueError(why)
    if in_motion == in_rest or not standing:
        return in_motion, [], []
    up, why = (in_rest, "the body crawls") if crawls else (in_motion, "the motion is more reliable")
    note = (
        f"From feet to head, the body points along {in_motion} and its rest pose along {in_rest}. {up} was "
        f"taken for up, because {why} (motion.up overrides this)."
    )
    return (up, [note], []) if crawls or _travels(clip, in_motion) else (up, [], [note])


def _along_body(skeleton: Skeleton, positions: Array) -> Array:
    """(F, 3) sum of the unit vectors from the feet to the hips and from the hips to the head.

    positions: (F, J, 3).
    """
    # The toe of each side, or its heel if the rig has no toe.
    roles = [f"{side}_{part}" for side in ("left", "right") for part in ("toe", "heel")]
    feet = [next(role for role in roles[i : i + 2] if role in skeleton.roles) for i in (0, 2)]
    head, hips, left, right = (positions[:, skeleton.role(name)] for name in ("head", "hips", *feet))
    return _unit(head - hips) + _unit(hips - 0.5 * (left + right))


def _crawls(clip: Clip, axis: str) -> bool:
    """Whether the body crawls: along `axis` it moves at least 0.9 times as far as along any other axis.

    axis: the axis from the feet to the head. If an upright figure moved like this, it would climb, but
    upright figures climb less far than they move over the ground. A jump does not count: its lowest joint is
    on the ground most of the time, so its quartiles differ by less than CLIMB.
    """
    along = clip.positions @ DIRECTIONS[axis]
    low, high = np.percentile(along.min(axis=1), [25, 75])
    travel = np.ptp(clip.root, axis=0)
    return bool(high - low > CLIMB and travel @ np.abs(DIRECTIONS[axis]) >= 0.9 * travel.max())


def _travels(clip: Clip, axis: str) -> bool:
    """Whether the figure moves further over the ground than it is tall. axis: the axis that points up."""
    up, level = DIRECTIONS[axis], 1 - np.abs(DIRECTIONS[axis])
    height = float(np.median(np.ptp(clip.positions @ up, axis=1)))
    return bool(np.linalg.norm(np.ptp(clip.root * level, axis=0)) > height)


def _handedness_of(clip: Clip) -> str:
    """The handedness of the coordinates, "right" or "left".

    If they are right-handed, the cross product of left and up points forward, like the feet.
    """
    left, up, feet = body_axes(clip.skeleton, clip.positions)
    return "left" if np.mean(np.sum(np.cross(left, up) * feet, axis=-1)) < -0.2 else "right"


def _with_x_negated(clip: Clip) -> Clip:
    """The clip with x negated, which changes left-handed to right-handed coordinates."""
    ends = {name: (-x, y, z) for name, (x, y, z) in clip.skeleton.end_sites.items()}
    return replace(
        clip,
        skeleton=replace(clip.skeleton, offsets=clip.skeleton.offsets * FLIP, end_sites=ends),
        rotations=clip.rotations * MIRROR,
        root=clip.root * FLIP,
        translations=None if clip.translations is None else clip.translations * FLIP,
    )


def _with_world_and_rest_turned(clip: Clip, world: Array, rest: Array) -> Clip:
    """The clip with its world turned by `world` (4,), and its rest pose turned by `rest` (4,).

    Turning the rest pose also turns the joints' own axes, so that no joint of the motion moves.
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


def turned_about_vertical(clip: Clip, angle: float) -> Clip:
    """The clip turned about the vertical line through its first root position.

    angle: radians, positive from +Z towards +X.
    """
    turn = quat.yaw(angle)
    rotations = clip.rotations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    start = clip.root[0] * [1, 0, 1]
    return replace(clip, rotations=rotations, root=quat.rotate(turn, clip.root - start) + start)
