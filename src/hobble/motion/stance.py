"""A rig's motion told anew on an upright one: the same joints in the same places, in a rest pose that stands.

What a joint's rotations mean depends on the pose in which all of them are zero. Where a person could stand in
that pose, it is the rest pose. Where nobody could (all bones along one axis, a heap of twisted bones), the
directions of the bones while the figure moves tell how each joint is turned when its bone points down a leg,
out along an arm or up the trunk; knees and elbows tell where a limb's front is, and feet that stand, what is
level.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import rest_positions
from hobble.motion.body import Body
from hobble.motion.flat_feet import doubt
from hobble.motion.from_motion import from_motion
from hobble.motion.from_rest import TRUSTED, add_rest, from_rest
from hobble.motion.orient import apart, mean, pointed
from hobble.motion.seen import LEFT, Seen
from hobble.motion.spine import SHORT, Spine
from hobble.motion.standing import stands
from hobble.motion.tell_anew import told_anew, with_balls
from hobble.motion.tree import above

SAMPLES = 400


@dataclass(frozen=True)
class Upright:
    """A clip whose rest pose stands, facing +Z with the arms out; its joints are those of the body.

    rest: where the stance is from, in words. body: the parts by their new indices. notes: sentences on what
    is uncertain.
    """

    clip: Clip = field(repr=False)
    body: Body
    rest: str
    notes: list[str] = field(default_factory=list)


def upright(clip: Clip, body: Body, spine: Spine, others: Collection[int] = ()) -> Upright:
    """The motion of a body on a rig that stands in its rest pose. clip: centimetres, right-handed, Y up.

    spine: where the bones of a trunk point in that pose.

    Where the bones point decides alone how trunk, limbs and feet are turned, so that the same motion comes
    out of any rig alike; a zero pose that stands adds what no bone shows: how head, clavicles and hands are
    turned. others: further joints that are to be kept, turned as the part of the body that they hang from.
    """
    every = np.unique(np.linspace(0, len(clip) - 1, SAMPLES).round().astype(int))
    ends = {
        side: clip.skeleton.end_sites.get(clip.skeleton.joints[leg[2]]) for side, leg in body.legs.items()
    }
    speeds = _speeds(clip)[every]
    seen = Seen(body, clip.positions[every], clip.global_rotations[every], speeds, ends, spine)
    rest = rest_positions(clip.skeleton)
    frames, problem = from_motion(seen), stands(body, rest)
    if problem is None:
        zero = from_rest(seen, rest)
        if max(apart(zero[j], frames[j]) for j in (body.hips, *body.trunk)) > TRUSTED:
            problem = "the trunk is twisted"
        else:
            add_rest(frames, zero, seen)
    said = "its zero pose" if problem is None else f"its motion, since in its zero pose {problem}"
    unsure = None if problem is None else doubt(seen)
    kept = _kept(clip, seen, others, frames)
    clip, body = with_balls(clip, body, frames)
    return Upright(*told_anew(clip, body, [*body.joints, *kept], frames), said, [unsure] if unsure else [])


def _speeds(clip: Clip) -> Array:
    """(F, J) cm a second."""
    if len(clip) < 2:
        return np.zeros(clip.positions.shape[:2])
    return np.linalg.norm(np.gradient(clip.positions, axis=0), axis=-1) * clip.fps


def _kept(clip: Clip, seen: Seen, others: Collection[int], frames: dict[int, Array]) -> list[int]:
    """Those of the other joints that can be kept, with their frames put into `frames`.

    Each is turned, on average, as the part of the body that it hangs from; the base of a finger points along
    it.
    """
    body, parents = seen.body, clip.skeleton.parents
    out = []
    for joint in sorted(set(others) - set(body.joints)):
        carrier = next((j for j in above(parents, joint)[1:] if j in body.joints), None)
        if carrier is None:
            continue
        part = quat.mul(seen.turned[:, carrier], frames[carrier])
        frames[joint] = mean(quat.mul(quat.inv(seen.turned[:, joint]), part))
        for side, sign in (("left", 1.0), ("right", -1.0)):
            tips = [j for j in others if joint in above(parents, j)[1:]]
            bones = [bone for j in tips if np.linalg.norm(bone := seen.bone(joint, j)) > SHORT]
            if carrier == body.arms[side][3] and bones:
                frames[joint] = pointed(frames[joint], sign * LEFT, bones[0])
        out.append(joint)
    return out
