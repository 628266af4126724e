"""Derives how joints are turned in a standing pose from the directions of the bones in motion."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.motion.body_sample import LEFT, BodySample
from hobble.motion.flat_feet import flat_feet
from hobble.motion.orient import frame, mean, unit

UP, AHEAD = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
AGREE = np.radians(25.0)  # trunk joints that differ by less have the same rest pose


def from_motion(seen: BodySample) -> dict[int, Array]:
    """Frames of all joints from the directions of the bones while the figure moves."""
    frames: dict[int, Array] = {}
    _trunk(seen, frames)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        _arm(seen, frames, side, sign)
        _leg(seen, frames, side)
    return frames | flat_feet(seen)


def _trunk(seen: BodySample, frames: dict[int, Array]) -> None:
    body = seen.body
    chain = (body.hips, *body.trunk)
    ends = (*body.neck, body.head)
    both = unit(seen.hips_left + seen.chest_left)
    steps = [
        float(np.median(np.linalg.norm(seen.at[:, b] - seen.at[:, a], axis=-1))) for a, b in pairwise(chain)
    ]
    way = np.concatenate([[0.0], np.cumsum(steps)])
    for i, joint in enumerate(chain):
        left = seen.hips_left if i == 0 else seen.chest_left if joint == body.chest else both
        following = (*chain[i + 1 :], *ends)
        bone = seen.first_long(joint, following)
        axis, own = seen.spine.at(way[i] / max(way[-1], 1e-9)), seen.local(joint, left)
        # Hips and chest are level where limbs begin. Spines of captured rigs bend sideways by some degrees.
        carries = joint in (body.hips, body.chest)
        frames[joint] = frame(own, LEFT, bone, axis) if carries else frame(bone, axis, own, LEFT)
    for i, joint in enumerate(body.neck):
        bone = seen.first_long(joint, ends[i + 1 :])
        axis = seen.spine.neck if joint == body.neck[-1] else seen.spine.at(1.0)
        frames[joint] = frame(bone, axis, seen.local(joint, seen.chest_left), LEFT)
    frames[body.head] = _head(seen, frames, (*chain, *body.neck))


def _head(seen: BodySample, frames: dict[int, Array], chain: Sequence[int]) -> Array:
    """The chest's frame if the whole trunk agrees on what is up.

    Otherwise the head looks ahead on average.
    """
    chest = frames[seen.body.chest]
    if len(chain) > 2 and max(float(quat.angle(frames[j], chest)) for j in chain) < AGREE:
        return chest
    ahead = unit(np.cross(seen.chest_left + seen.hips_left, UP) * [1, 0, 1])
    up = seen.local(seen.body.head, np.broadcast_to(UP, ahead.shape))
    return frame(up, UP, seen.local(seen.body.head, ahead), AHEAD)


def _arm(seen: BodySample, frames: dict[int, Array], side: str, sign: float) -> None:
    clavicle, shoulder, elbow, wrist = seen.body.arms[side]
    chest = quat.mul(seen.turned[:, seen.body.chest], frames[seen.body.chest])
    if clavicle is not None:
        frames[clavicle] = mean(quat.mul(quat.inv(seen.turned[:, clavicle]), chest))
    hinge = seen.hinge(shoulder, elbow, wrist, -seen.chest_left)
    for start, end in ((shoulder, elbow), (elbow, wrist)):
        frames[start] = frame(seen.bone(start, end), sign * LEFT, seen.local(start, hinge), -sign * UP)
    forearm = quat.mul(seen.turned[:, elbow], frames[elbow])
    frames[wrist] = seen.hand(side, mean(quat.mul(quat.inv(seen.turned[:, wrist]), forearm)), sign)


def _leg(seen: BodySample, frames: dict[int, Array], side: str) -> None:
    hip, knee, heel, _ = seen.body.legs[side]
    hinge = seen.hinge(hip, knee, heel, seen.hips_left)
    for start, end in ((hip, knee), (knee, heel)):
        frames[start] = frame(seen.bone(start, end), -UP, seen.local(start, hinge), LEFT)
