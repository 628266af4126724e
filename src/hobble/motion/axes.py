"""Directions and rotations of bodies, and the axes of a file: which way is up, handedness, facing.

Hobble's clips are right-handed with Y up. Their rest poses face +Z, with the left at +X. Rotations are
quaternions (4,).
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, rest_positions

LEFT, UP, AHEAD = np.eye(3)  # of a figure that faces +Z
# Factors that mirror at the plane x = 0: FLIP for a position (3,), MIRROR for a quaternion (4,).
FLIP = np.array([-1.0, 1.0, 1.0])
MIRROR = np.array([1.0, 1.0, -1.0, -1.0])
# cm: a figure crawls or climbs along an axis only if its lowest joint moves by more than this along the axis.
# The movement is measured between the quartiles of the joint's places.
CLIMB = 20.0
FLAT = 0.35  # end sites of ankles point ahead if they lie this share of their distance ahead, not under them
DIRECTIONS = {  # name of an axis, such as "-X" -> (3,) unit vector
    sign + axis: np.eye(3)["XYZ".index(axis)] * (1 if sign == "+" else -1) for sign in "+-" for axis in "XYZ"
}


def unit(vectors: Array) -> Array:
    """The vectors (..., 3), scaled to length 1. A zero vector stays zero."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)


def angles_between(a: Array, b: Array) -> Array:
    """Angles (...) in radians between vectors (..., 3) of any length."""
    return np.arccos(np.clip(np.sum(unit(a) * unit(b), axis=-1), -1.0, 1.0))


def degrees_between(a: Array, b: Array) -> Any:
    """The same in degrees."""
    return np.degrees(angles_between(a, b))


def aligned(first: Array, from_first: Array, second: Array, from_second: Array) -> Array:
    """The rotation (4,) that turns one direction exactly, and a second one as nearly as possible.

    It turns `from_first` to `first`. Among the rotations that do this, it is the one that turns `from_second`
    nearest to `second`. All are vectors (3,) of any length.
    """
    return quat.from_matrix(_right_angles(first, second) @ _right_angles(from_first, from_second).T)


def _right_angles(first: Array, second: Array) -> Array:
    """(3, 3) matrix whose columns are unit vectors at right angles: x along `first`, y towards `second`."""
    x = unit(first)
    y = unit(second - x * (second @ x))
    if np.linalg.norm(y) < 0.5:  # zero, because the two are parallel: take any y at right angles to x
        k = int(np.argmin(np.abs(x)))
        y = unit(np.eye(3)[k] - x * x[k])
    return np.stack([x, y, np.cross(x, y)], axis=1)


def snapped(rotation: Array) -> Array:
    """The rotation (4,), made exact if it turns each of the X, Y and Z axes to within 20 degrees of an axis.

    The exact rotation turns each axis to the axis that it was near, positive or negative. Any other rotation
    is returned unchanged.
    """
    axes = quat.to_matrix(rotation)
    exact = np.round(axes)
    near = np.sum(axes * exact, axis=0).min() > np.cos(np.radians(20.0))
    return quat.from_matrix(exact) if near and np.all(np.abs(exact).sum(axis=0) == 1) else rotation


def pointed_along(rotation: Array, axis: Array, bone: Array) -> Array:
    """The rotation (4,), changed as little as possible so that it turns `axis` to the direction of `bone`.

    axis, bone: vectors (3,).
    """
    return quat.mul(quat.between(quat.rotate(rotation, axis), bone), rotation)


def bend_direction(hip: Array, knee: Array, heel: Array) -> Array:
    """(..., 3) how far the middle joint of a limb lies out from the line between the ends (positions)."""
    line = unit(heel - hip)
    return knee - hip - line * np.sum((knee - hip) * line, axis=-1, keepdims=True)


def body_axes(skeleton: Skeleton, positions: Array) -> tuple[Array, Array, Array]:
    """Vectors (..., 3): unit ones from right to left and from hips to head, and one that points forward.

    Forward is the direction of the feet or, on a rig without toes, the direction in which the knees point.
    Its length says how much it tells: that of a nearly straight leg is short. positions: (..., J, 3) of the
    joints.
    """
    at = {role: positions[..., skeleton.role(role), :] for role in skeleton.roles}
    left = at["left_hip"] - at["right_hip"] + at["left_shoulder"] - at["right_shoulder"]
    upward = at["head"] - at["hips"]
    ahead: Array = np.zeros_like(left)
    for side in ("left", "right"):
        if f"{side}_toe" in at:
            ahead = ahead + at[f"{side}_toe"] - at[f"{side}_heel"]
        else:
            knee = bend_direction(*(at[f"{side}_{part}"] for part in ("hip", "knee", "heel")))
            ahead = ahead + knee * np.linalg.norm(knee, axis=-1, keepdims=True)
    ahead = unit(ahead) if "left_toe" in at else ahead
    return unit(left), unit(upward), ahead


def _end_sites_ahead(clip: Clip, upward: Array) -> Array | None:
    """(F, 3) where the end sites of the ankles are from them, across `upward`; None if they do not tell."""
    sites, ahead = clip.skeleton.end_sites, np.zeros((len(clip), 3))
    for heel in (clip.skeleton.role("left_heel"), clip.skeleton.role("right_heel")):
        site = np.array(sites.get(clip.skeleton.joints[heel], (0.0, 0.0, 0.0)))
        place = quat.rotate(clip.global_rotations[:, heel], site)
        across = place - upward * np.sum(place * upward, axis=-1, keepdims=True)
        if np.median(np.linalg.norm(across, axis=-1)) <= FLAT * np.linalg.norm(site):
            return None
        ahead = ahead + across
    return ahead


def rest_frame(skeleton: Skeleton) -> Array:
    """(4,) rotation that turns X to the body's left in the rest pose, Y to its up, and Z to its front."""
    left, up, _ = body_axes(skeleton, rest_positions(skeleton))
    up = unit(up - left * (up @ left))
    return snapped(quat.from_matrix(np.stack([left, up, np.cross(left, up)], axis=1)))


def straighten(
    clip: Clip, up: str, handedness: str, standing: bool
) -> tuple[Clip, dict[str, str], str, bool]:
    """The clip with right-handed coordinates and Y up, and the `up` and `handedness` of its file.

    up: such as "+Y"; in left-handed coordinates, after x has been negated. Also returns a sentence if motion
    and rest pose disagree on which axis is up, else "", and whether this is in doubt. It is not if the figure
    crawls or moves far over the ground.

    A rest pose that faces along an axis is turned to +Z. An oblique rest pose is left as it is.

    up: "auto", "Y" or "Z". handedness: "auto", "right" or "left". With "auto", the axes are found from the
    motion. Up is then the axis nearest to the line from the feet over the hips to the head. If the figure
    crawls, this line in the rest pose is used. standing: whether a person can stand in the rest pose. If not,
    the rest pose does not show which axis is up.

    Raises ValueError with up = "auto" if the figure crawls and nobody can stand in the rest pose.
    """
    up_axis, note, in_doubt = _up_axis(clip, standing) if up == "auto" else (f"+{up}", "", False)
    if handedness == "auto":
        left, upward, ahead = body_axes(clip.skeleton, clip.positions)
        if "left_toe" not in clip.skeleton.roles:
            sites = _end_sites_ahead(clip, upward)
            ahead = ahead if sites is None else sites
        # In right-handed coordinates, the cross product of left and up points forward, like the feet.
        along = np.sum(np.cross(left, upward) * ahead)
        handedness = "left" if along < -0.2 * np.linalg.norm(ahead, axis=-1).sum() else "right"
    if handedness == "left":
        clip = changed(clip, lambda v: v * FLIP, clip.rotations * MIRROR, clip.root * FLIP)
        up_axis = {"+X": "-X", "-X": "+X"}.get(up_axis, up_axis)
    rest = rest_frame(clip.skeleton)
    along_axis = np.abs(quat.rotate(rest, AHEAD)).max() > 1 - 1e-9
    world = quat.between(DIRECTIONS[up_axis], UP)
    turned = _turned(clip, world, quat.inv(rest) if along_axis else quat.IDENTITY)
    return turned, {"up": up_axis, "handedness": handedness}, note, in_doubt


def _up_axis(clip: Clip, standing: bool) -> tuple[str, str, bool]:
    """The axis that points up, and what `straighten` returns last."""

    def axis_of_body(positions: Array) -> str:
        along = _along_body(clip.skeleton, positions).mean(axis=0)
        return max(DIRECTIONS, key=lambda axis: float(DIRECTIONS[axis] @ along))

    in_motion, in_rest = map(axis_of_body, (clip.positions, rest_positions(clip.skeleton)[None]))
    crawls = _crawls(clip, in_motion)
    if not standing and crawls:
        moves = f"the body moves from its feet to its head ({in_motion}) as if it crawled"
        raise ValueError(f"{moves}, and nobody could stand in its zero pose")
    if in_motion == in_rest or not standing:
        return in_motion, "", False
    up, why = (in_rest, "the body crawls") if crawls else (in_motion, "the motion is more reliable")
    apart = f"From feet to head, the body points along {in_motion} and its rest pose along {in_rest}"
    note = f"{apart}. {up} was taken for up, because {why} (motion.up overrides this)."
    return up, note, not crawls and not _travels(clip, in_motion)


def _along_body(skeleton: Skeleton, positions: Array) -> Array:
    """(F, 3) sum of the unit vectors from the feet (toes, or else heels) to the hips and on to the head.

    positions: (F, J, 3).
    """
    ends = ("toe" if f"{side}_toe" in skeleton.roles else "heel" for side in ("left", "right"))
    roles = ("head", "hips", *(f"{side}_{end}" for side, end in zip(("left", "right"), ends, strict=True)))
    head, hips, left, right = (positions[:, skeleton.role(role)] for role in roles)
    return unit(head - hips) + unit(hips - 0.5 * (left + right))


def _crawls(clip: Clip, axis: str) -> bool:
    """Whether the body crawls: along `axis` it moves at least 0.9 times as far as along any other axis.

    axis: the axis from the feet to the head. If an upright figure moved like this, it would climb, but
    upright figures climb less far than they move over the ground. A jump does not count: its lowest joint is
    on the ground most of the time, so its quartiles differ by less than CLIMB.
    """
    low, high = np.percentile((clip.positions @ DIRECTIONS[axis]).min(axis=1), [25, 75])
    travel = np.ptp(clip.root, axis=0)
    return bool(high - low > CLIMB and travel @ np.abs(DIRECTIONS[axis]) >= 0.9 * travel.max())


def _travels(clip: Clip, axis: str) -> bool:
    """Whether the figure moves further over the ground than it is tall. axis: the axis that points up."""
    height = float(np.median(np.ptp(clip.positions @ DIRECTIONS[axis], axis=1)))
    level = 1 - np.abs(DIRECTIONS[axis])
    return bool(np.linalg.norm(np.ptp(clip.root * level, axis=0)) > height)


def _turned(clip: Clip, world: Array, rest: Array) -> Clip:
    """The clip with its world turned by `world` (4,), and its rest pose turned by `rest` (4,).

    Turning the rest pose also turns the joints' own axes, so that no joint of the motion moves.
    """
    if np.allclose(world, quat.IDENTITY) and np.allclose(rest, quat.IDENTITY):
        return clip
    rotations = quat.mul(quat.mul(rest, clip.rotations), quat.inv(rest))
    rotations[:, 0] = quat.mul(quat.mul(world, clip.rotations[:, 0]), quat.inv(rest))
    return changed(clip, lambda v: quat.rotate(rest, v), rotations, quat.rotate(world, clip.root))


def changed(clip: Clip, vectors: Callable[[Array], Array], rotations: Array, root: Array) -> Clip:
    """The clip with other rotations and roots. vectors: changes all vectors (..., 3) in axes of joints."""
    ends = {name: tuple(vectors(np.array(end)).tolist()) for name, end in clip.skeleton.end_sites.items()}
    skeleton = replace(clip.skeleton, offsets=vectors(clip.skeleton.offsets), end_sites=ends)
    translations = None if clip.translations is None else vectors(clip.translations)
    return replace(clip, skeleton=skeleton, rotations=rotations, root=root, translations=translations)
