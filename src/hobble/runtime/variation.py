"""Steps that differ: each step of a character takes a little more or less time and way than the last.

The changes follow from a seed and the number of the step, so that the same seed gives the same walk. The
spreads are those of people: the time of a stride varies by some .03 s in a healthy walk and by .1 s in a
strong limp (Jun et al. 2020). The random numbers come from whole numbers, so that other languages can compute
the same.
"""

import numpy as np

from hobble.core.quat import Array

# Streams of random numbers: time and length of a step, how much an injury shows in it, and what differs
# between the two sides of one person.
TIME, LENGTH, SHOWN, PERSON = range(4)
# Standard deviations as shares, for a body at rest and for one with the highest channel value.
HEALTHY = {TIME: 0.035, LENGTH: 0.03, SHOWN: 0.0}
HURT = {TIME: 0.11, LENGTH: 0.08, SHOWN: 0.12}
SIDES_DIFFER = 0.015  # standard deviation, over persons, of the time that steps to one side take longer


def step_noise(seed: np.ndarray, step: np.ndarray, stream: int) -> Array:
    """(C,) numbers with mean 0 and standard deviation 1, about normal, at most 3.5 in size.

    seed, step: (C,) whole numbers. The number is the sum of the four bytes of a hash of 32 bits (the mixing
    function lowbias32 of C. Wellons, 2018), less its mean 510, divided by its standard deviation 147.8.
    """
    mask = np.uint64(0xFFFFFFFF)
    seeds, steps = np.asarray(seed, np.uint64), np.asarray(step, np.uint64)
    x = seeds * np.uint64(0x9E3779B1) + steps * np.uint64(0x85EBCA77) + np.uint64(stream * 0xC2B2AE3D)
    x &= mask
    for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B), (16, 1)):
        x = ((x ^ (x >> np.uint64(shift))) * np.uint64(factor)) & mask
    total = sum((x >> np.uint64(8 * byte)) & np.uint64(0xFF) for byte in range(4))
    return (np.asarray(total, float) - 510.0) / 147.8


def vary_step(seed: np.ndarray, step: np.ndarray, hurt: Array, amount: float) -> tuple[Array, Array, Array]:
    """Factors (C,) of a step's pace (change of phase), of the target speed, and of the values of injuries.

    seed, step: (C,) whole numbers. step: half cycles since the start; it is even in the half that
    begins as the right foot lands. hurt: (C,) the highest value as a share of the highest possible one.
    amount: 0 for no variation, 1 for that of people. Every factor is 1 + amount * deviation * `step_noise`.
    """

    def deviation(stream: int) -> Array:
        spread = HEALTHY[stream] + hurt * (HURT[stream] - HEALTHY[stream])
        return amount * spread * step_noise(seed, step, stream)

    side = np.asarray(step) % 2
    person = amount * SIDES_DIFFER * np.where(side == 0, 1.0, -1.0) * step_noise(seed, 0 * side, PERSON)
    return 1.0 + deviation(TIME) + person, 1.0 + deviation(LENGTH), 1.0 + deviation(SHOWN)


def count_steps(step: np.ndarray, phase: Array) -> None:
    """Add 1 to `step` (C,), in place, where the phase (C,), 0 to 1, has entered the other half cycle."""
    step += np.floor(2 * np.asarray(phase)) % 2 != step % 2
