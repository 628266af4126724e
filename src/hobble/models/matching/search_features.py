"""The features that motion matching compares: weighted columns of X.

After Holden, Kanoun, Perepichka, Popa, Learned Motion Matching (2020), section 3. The features are
path positions and facing directions at one third, two thirds and the end of the trajectory ahead, position
and velocity of both feet, and velocity of the hips. Hobble adds the gait, the ground heights ahead and the
channel values.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hobble.channels import channel
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.models.matching.options import MatchingOptions
from hobble.rows.layout import GAITS, RowLayout

FEET = ("left_heel", "right_heel")  # the joints of the skeleton with these roles
LEAST_SPREAD = 1e-6  # a group of columns with a smaller mean standard deviation gets weight 0


def feature_groups(
    layout: RowLayout, skeleton: Skeleton, options: MatchingOptions
) -> list[tuple[str, list[int], float]]:
    """(name, columns of X, weight) of each group of features. All columns of a group get the same factor."""
    samples, now = layout.samples, layout.samples // 2  # now: index of the trajectory sample at the present
    ahead = sorted({now + max(0, round(layout.future * third / 3) - 1) for third in (1, 2, 3)})
    positions, velocities = layout.x_joint_position, layout.x_joint_velocity

    def columns_ahead(block: slice) -> list[int]:
        return [block.start + axis * samples + sample for axis in range(2) for sample in ahead]

    def joint_columns(block: slice, role: str) -> list[int]:
        return [block.start + 3 * skeleton.role(role) + axis for axis in range(3)]

    groups = [
        ("path", columns_ahead(layout.x_position), options.path),
        ("facing", columns_ahead(layout.x_direction), options.facing),
        *((f"{foot} position", joint_columns(positions, foot), options.foot_position) for foot in FEET),
        *((f"{foot} velocity", joint_columns(velocities, foot), options.foot_velocity) for foot in FEET),
        ("hips velocity", joint_columns(velocities, "hips"), options.hip_velocity),
        ("gait", [layout.x_gait.start + gait * samples + now for gait in range(len(GAITS))], options.gait),
        # The heights left of the path come first, then those on it.
        ("ground", [layout.x_terrain.start + samples + sample for sample in ahead], options.ground),
    ]
    return groups + [
        (name, _columns_of(layout.x_channel(name)), options.channels) for name, _ in layout.channels
    ]


def columns_and_weights(
    layout: RowLayout, skeleton: Skeleton, options: MatchingOptions, x: Array
) -> tuple[NDArray[np.int64], Array]:
    """Columns of X (n,) and their factors (n,) float32, with which features of different units are compared.

    x: (R, X) the inputs of all frames, in raw units. The factor of a group is its weight divided by the mean
    standard deviation of its columns, as in the paper. With a deviation for each column, columns that hardly
    vary would be amplified. The weight of a channel is divided by the channel's highest value instead, so
    that the factor does not depend on how many frames have a value above 0.
    """
    columns: list[int] = []
    weights: list[Array] = []
    for name, group, weight in feature_groups(layout, skeleton, options):
        if name in dict(layout.channels):
            spread = channel(name).highest
        else:
            spread = float(x[:, group].std(axis=0, dtype=np.float64).mean())
        columns += group
        weights.append(np.full(len(group), weight / spread if spread > LEAST_SPREAD else 0.0, np.float32))
    return np.array(columns, np.int64), np.concatenate(weights)


def _columns_of(block: slice) -> list[int]:
    return list(range(block.start, block.stop))
