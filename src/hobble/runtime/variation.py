"""Steps that differ: each takes a little more or less time and way than the last, and knees and arms differ.

The changes follow from a seed and the number of the step, so that the same seed gives the same walk. The
spreads are those of people: the time of a stride varies by some .03 s in a healthy walk and by .1 s in a
strong limp (Jun et al. 2020). The random numbers come from whole numbers, so that other languages can compute
the same. Knees and arms differ only in the pose that is drawn: the network does not see it, so that the walk
stays as steady as it was.
"""

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton

# Streams of random numbers: time and length of a step, how much an injury shows in it, what differs between
# the two sides of one person, how far the swinging knee bends, and how far the arm of its side swings.
STREAMS = TIME, LENGTH, SHOWN, PERSON, KNEE, ARM = range(6)
# Standard deviations of each stream, for a body at rest and for one with the highest channel value: radians
# of the knee, shares of all else. With these the range of the knee varies about as in people, by 3.7 degrees
# in a healthy walk and by 7.5 to 9.7 in a limp; left and right differ by 4.6 degrees of knee and 11 of arm.
HEALTHY = np.array([0.035, 0.03, 0.0, 0.0, 0.066, 0.1])
HURT = np.array([0.11, 0.08, 0.12, 0.0, 0.17, 0.2])
# Standard deviations, over persons, of what steps to one side have more, and those to the other side less.
SIDES_DIFFER = np.array([0.015, 0.0, 0.0, 0.0, 0.052, 0.225])
SWING_MIX = 0.15  # a share of the way that is left, each frame, from the last swing of a side to the present
MEAN_MIX = 1 / 60  # the same of the mean direction of an arm, about which it swings


def step_noise(seed: np.ndarray, step: np.ndarray, stream: int | np.ndarray) -> Array:
    """(...) numbers with mean 0 and standard deviation 1, about normal, at most 3.5 in size.

    seed, step, stream: (...) whole numbers. The number is the sum of the four bytes of a hash of 32 bits, the
    mixing function lowbias32 of C. Wellons (2018), less its mean 510, divided by its deviation 147.8.
    """
    mask = np.uint64(0xFFFFFFFF)
    seeds, steps, streams = (np.asarray(each, np.uint64) for each in (seed, step, stream))
    x = seeds * np.uint64(0x9E3779B1) + steps * np.uint64(0x85EBCA77) + streams * np.uint64(0xC2B2AE3D)
    x &= mask
    for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B), (16, 1)):
        x = ((x ^ (x >> np.uint64(shift))) * np.uint64(factor)) & mask
    total = sum((x >> np.uint64(8 * byte)) & np.uint64(0xFF) for byte in range(4))
    return (np.asarray(total, float) - 510.0) / 147.8


def vary_step(
    seed: np.ndarray, step: np.ndarray, hurt: Array, amount: float
) -> tuple[Array, Array, Array, Array]:
    """Factors (C,) of a step's pace (change of phase), of the target speed, and of the values of injuries.

    The fourth result (C, 2) is for the swinging leg: radians that its knee bends more, and the share that the
    arm of its side swings more.

    seed, step: (C,) whole numbers. step: half cycles since the start; it is even in the half that
    begins as the right foot lands. hurt: (C,) the highest value as a share of the highest possible one.
    amount: 0 for no variation, 1 for that of people. Every factor is 1 + amount * deviation * `step_noise`.
    """
    seeds, steps, streams = np.asarray(seed)[:, None], np.asarray(step)[:, None], np.array(STREAMS)
    spread = HEALTHY + hurt[:, None] * (HURT - HEALTHY)
    person = SIDES_DIFFER * np.where(steps % 2 == 0, 1.0, -1.0) * step_noise(seeds, streams, PERSON)
    more = amount * (spread * step_noise(seeds, steps, streams) + person)
    return 1.0 + more[:, TIME], 1.0 + more[:, LENGTH], 1.0 + more[:, SHOWN], more[:, [KNEE, ARM]]


def mix_swing(more: tuple[Array, Array], step: np.ndarray, target: Array) -> None:
    """Bring what the knees and the arms do more, (C, 2) each, left and right, nearer to `target`, in place.

    target: (C, 2) the last result of `vary_step`, of the side that swings: the left one in an even step (C,).
    """
    at = np.arange(len(target)), np.asarray(step).astype(int) % 2
    for present, wanted in zip(more, target.T, strict=True):
        present[at] += SWING_MIX * (wanted - present[at])


Arm = tuple[int, int, np.ndarray]


def find_arms(skeleton: Skeleton) -> tuple[Arm, Arm]:
    """Of the left arm and of the right: the shoulder, the elbow, and all joints from the shoulder down."""

    def arm(side: str) -> Arm:
        shoulder, elbow = (skeleton.role(f"{side}_{part}") for part in ("shoulder", "elbow"))
        below = [j for j in range(len(skeleton.joints)) if j == shoulder or skeleton.path_up(j, shoulder)]
        return shoulder, elbow, np.array(below)

    return arm("left"), arm("right")


def swing_arms(
    arms: tuple[Arm, Arm], share: Array, mean: Array, yaw: Array, position: Array, rotation: Array
) -> None:
    """Turn the arms of C poses further from their mean direction, or nearer to it, ahead and back.

    An arm that is held still keeps its direction, and so do both while the character stands.
    share: (C, 2) how much further each arm swings. mean: (C, 2) the sine of its angle ahead of the body, as a
    mean of about a second, which is brought nearer to that of this frame. yaw: (C,) of the root. position
    (C, J, 3), rotation (C, J, 4): the poses. They and `mean` change in place.
    """
    sine, cosine = np.sin(yaw), np.cos(yaw)
    to_right = np.stack([-cosine, 0.0 * yaw, sine], axis=1)
    for side, (shoulder, elbow, below) in enumerate(arms):
        bone = position[:, elbow] - position[:, shoulder]
        ahead = (bone[:, 0] * sine + bone[:, 2] * cosine) / np.maximum(np.linalg.norm(bone, axis=1), 1e-6)
        mean[:, side] += MEAN_MIX * (ahead - mean[:, side])
        turn = quat.from_axis_angle(to_right, share[:, side] * (ahead - mean[:, side]))[:, None]
        position[:, below] = position[:, [shoulder]] + quat.rotate(
            turn, position[:, below] - position[:, [shoulder]]
        )
        rotation[:, below] = quat.mul(turn, rotation[:, below])


def count_steps(step: np.ndarray, phase: Array) -> None:
    """Add 1 to `step` (C,), in place, where the phase (C,), 0 to 1, has entered the other half cycle."""
    step += np.floor(2 * np.asarray(phase)) % 2 != step % 2
