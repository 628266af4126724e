"""Combines two captured clips by parts of the body: the arms of one with the legs of another.

So a clip of a hurt arm and a clip of a hurt leg give a clip of both, which nobody has captured. Ferre et al.
(2019) leave this as future work. The second clip is played so that its gait cycles keep time with those of
the first.
"""

from dataclasses import replace

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.core.smooth import smoothstep
from hobble.hurt.healthy_clip import interpolate_rotations
from hobble.labels.clip_labels import Labels

# Part of the body that is taken from the second clip -> roles of the ends of its limbs.
PARTS = {
    "arms": ("left_wrist", "right_wrist"),
    "left arm": ("left_wrist",),
    "right arm": ("right_wrist",),
    "upper body": ("left_wrist", "right_wrist", "head"),
}
BLEND = 12  # frames over which one gait cycle of the second clip is blended into the next


def combine_clips(
    body: Clip, body_labels: Labels, other: Clip, other_labels: Labels, part: str, name: str
) -> Clip:
    """The clip `body` with a part of the body from the clip `other`, of the same skeleton.

    Joints of the part keep their rotations relative to the joint above, so they follow the trunk of `body`.
    part: a key of PARTS. name: of the result. Raises HobbleError for other skeletons, and for a clip without
    gait cycles.
    """
    if body.skeleton.joints != other.skeleton.joints:
        raise HobbleError(f"{other.name} has other joints than {body.name}: retarget both to one skeleton")
    for clip, labels in ((body, body_labels), (other, other_labels)):
        if not len(labels.cycles):
            raise HobbleError(f"{clip.name} has no gait cycle, so its steps cannot be matched")
    joints = joints_of_part(body.skeleton, part)
    taken = _at_phase(other.rotations[:, joints], other_labels, _cycles(body_labels))
    rotations = body.rotations.copy()
    rotations[:, joints] = taken
    return replace(body, name=name, rotations=rotations)


def joints_of_part(skeleton: Skeleton, part: str) -> list[int]:
    """Indices of the joints of a part of PARTS: all below the chest, or below the hips for the upper body."""
    above = skeleton.role("hips" if part == "upper body" else "chest")
    # The uppermost joints of the part.
    roots = {skeleton.path_up(skeleton.role(role), above)[-1] for role in PARTS[part]}
    return [j for j in range(len(skeleton.joints)) if roots & set(skeleton.path_up(j))]


def _cycles(labels: Labels) -> Array:
    """(F,) gait cycles since the beginning of the first one of `labels.cycles`, with fractions."""
    cycles = labels.phase[0] + np.concatenate([[0.0], np.cumsum(np.mod(np.diff(labels.phase), 1.0))])
    return np.asarray(cycles - np.round(cycles[labels.cycles[0, 0]]))


def _at_phase(rotations: Array, labels: Labels, cycles: Array) -> Array:
    """Rotations of a clip at given moments of its gait cycles, which are played one after another.

    rotations: (F, J, 4). labels: those of the clip. cycles: (N,), as from `_cycles`.
    After the last cycle, the first follows again.
    """
    number, phase = np.divmod(cycles, 1.0)
    when = np.empty(len(cycles))
    for k in np.unique(number).astype(int):
        first, last = labels.cycles[k % len(labels.cycles)]
        run = np.mod(np.diff(labels.phase[first : last + 1]), 1.0).cumsum()
        phases = labels.phase[first] + np.concatenate([[0.0], run])  # from nearly 0 to nearly 1
        now = number == k
        when[now] = np.interp(phase[now], phases, np.arange(first, last + 1))
    out = interpolate_rotations(rotations, when)
    for cut in (np.flatnonzero(np.diff(number)) + 1).tolist():
        span = np.arange(cut, min(cut + BLEND, len(when)))
        tempo = when[cut - 1] - when[max(cut - 2, 0)]
        as_before = interpolate_rotations(rotations, when[cut - 1] + tempo * (span - cut + 1))
        share = smoothstep((span - cut + 1) / (BLEND + 1))
        out[span] = quat.slerp(as_before, out[span], share[:, None])
    return out
