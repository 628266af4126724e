"""The features that motion matching compares: weighted columns of X.

After Holden, Kanoun, Perepichka, Popa, Learned Motion Matching (2020), section 3: path and facing at one
third, two thirds and the end of the window ahead, position and velocity of both feet, and velocity of the
hips. Hobble adds the gait, the heights ahead and the channel values.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hobble.channels import channel
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.models.matching.options import MatchingOptions
from hobble.rows.layout import GAITS, RowLayout

FEET = ("left_heel", "right_heel")  # roles of the joints
LEAST_SPREAD = 1e-6  # a group of columns with a smaller standard deviation gets weight 0


def groups(
    layout: RowLayout, skeleton: Skeleton, options: MatchingOptions
) -> list[tuple[str, list[int], float]]:
    """(name, columns of X, weight) of each group of features. All columns of a group get the same factor."""
    samples, now = layout.samples, layout.samples // 2
    ahead = sorted({now + max(0, round(layout.future * third / 3) - 1) for third in (1, 2, 3)})
    position, velocity = layout.x_joint_position.start, layout.x_joint_velocity.start

    def coordinates_ahead(block: slice) -> list[int]:
        return [block.start + axis * samples + at for axis in range(2) for at in ahead]

    def of_joint(start: int, role: str) -> list[int]:
        return [start + 3 * skeleton.role(role) + axis for axis in range(3)]

    features = [
        ("path", coordinates_ahead(layout.x_position), options.path),
        ("facing", coordinates_ahead(layout.x_direction), options.facing),
        *((f"{foot} position", of_joint(position, foot), options.foot_position) for foot in FEET),
        *((f"{foot} velocity", of_joint(velocity, foot), options.foot_velocity) for foot in FEET),
        ("hips velocity", of_joint(velocity, "hips"), options.hip_velocity),
        ("gait", [layout.x_gait.start + g * samples + now for g in range(len(GAITS))], options.gait),
        ("ground", [layout.x_terrain.start + samples + at for at in ahead], options.ground),
    ]
    return features + [
        (name, _columns(layout.x_channel(name)), options.channels) for name, _ in layout.channels
    ]


def columns_and_weights(
    layout: RowLayout, skeleton: Skeleton, options: MatchingOptions, x: Array
) -> tuple[NDArray[np.int64], Array]:
    """Columns of X (n,) and their factors (n,) float32, which make distances comparable.

    x: (R, X) the rows of the clips, raw. A group is divided by the mean standard deviation of its columns, as
    in the paper: dividing each column by its own deviation would amplify columns that hardly vary. A channel
    is divided by its highest value, so that its scale does not depend on how often the clips have it.
    """
    columns: list[int] = []
    weights: list[Array] = []
    for name, group, weight in groups(layout, skeleton, options):
        if name in dict(layout.channels):
            spread = channel(name).highest
        else:
            spread = float(x[:, group].std(axis=0, dtype=np.float64).mean())
        columns += group
        weights.append(np.full(len(group), weight / spread if spread > LEAST_SPREAD else 0.0, np.float32))
    return np.array(columns, np.int64), np.concatenate(weights)


def _columns(block: slice) -> list[int]:
    return list(range(block.start, block.stop))
