"""Finds how far the chest leans on a rig that has no neck: no joint between chest and head.

On other rigs, the direction of the neck shows how far the chest leans. On a rig without a neck, the neck is
assumed to lean as far as people's necks do on average.
"""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.motion.body_sample import BodySample
from hobble.motion.orient import unit_vectors
from hobble.motion.spine import SHORT

# Radians by which the first bone of a person's neck leans forward. AHEAD: from the vertical, in a standing
# zero pose (all rotations zero). AHEAD_OF_HEAD: from the line that goes from chest to head. Both are means
# over seven subjects of CMU. Each _ERROR is the standard deviation.
AHEAD, AHEAD_ERROR = np.radians(5.4), np.radians(2.6)
AHEAD_OF_HEAD, AHEAD_OF_HEAD_ERROR = np.radians(5.6), np.radians(3.9)


def lacks_neck(sample: BodySample) -> bool:
    """Whether a neck must be assumed: the rig has none, but the skeleton to which it is retargeted has one.

    A joint at the same place as the chest is no neck.
    """
    body, target = sample.body, sample.target_proportions.spine
    return target.has_neck and all(sample.length(body.chest, joint) <= SHORT for joint in body.neck)


def neck_bone(sample: BodySample, left: Array, zero: Array | None) -> Array:
    """(3,) direction of the assumed neck, in the chest's coordinates.

    left: (3,) direction to the body's left, in the chest's coordinates. zero: (4,) rotation from the axes of
    a figure that stands facing +Z to the axes of the chest, according to the zero pose; None if nobody could
    stand in that pose.
    """
    if zero is not None:
        return quat.rotate(zero, np.array([0.0, np.cos(AHEAD), np.sin(AHEAD)]))
    head = sample.bone(sample.body.chest, sample.body.head)
    return quat.rotate(quat.from_axis_angle(unit_vectors(left), np.array(AHEAD_OF_HEAD)), unit_vectors(head))


def lean_doubt(sample: BodySample, zero: bool) -> str | None:
    """A warning that it is uncertain how far the chest leans, if the rig has no neck, else None.

    zero: whether a person could stand in the zero pose.
    """
    if not lacks_neck(sample):
        return None
    body, error = sample.body, AHEAD_ERROR if zero else AHEAD_OF_HEAD_ERROR
    # cm from chest to shoulders. An error of the lean moves the shoulders by angle times distance.
    distance = float(np.mean([sample.length(body.chest, arm[1]) for arm in body.arms.values()]))
    return (
        "The rig has no joint for the neck, so it is uncertain how far the chest leans: arms may lie "
        f"{2 * error * distance:.0f} cm too far forward or back."
    )
