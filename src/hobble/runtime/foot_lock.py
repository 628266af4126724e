"""Decides where a foot is held, and how long: until the network lifts it, or until it has to step.

Below, "the network's foot" is the foot where the network predicts it. A network often predicts contact while
it moves the foot: for a few frames at the end of a stance, and for seconds when the foot glides. A held foot
then falls behind the network's foot. No foot can be held for ever, and a foot that is let go while it
stands drags over the ground. So the runtime makes it step: the foot is lifted, swings to the network's foot
and lands there.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.compiled import njit

# A foot is held from this predicted contact on. With .8, as in the runtime of Holden et al. (2017), a foot
# slides 4.8 cm a step before it is held and after it is released.
LOCK_AT = 0.5
# After contact, `lock` (1: held, 0: free) falls by this much in each frame. With .075 the foot drags behind
# the swing, and the knee bends by 46 degrees instead of the 53 that the network predicts.
RELEASE = 0.2
TOO_FAR = 20.0  # cm; a held foot steps if the network's foot is this far away from it
MISSED = 1.0  # cm; a held foot steps if its leg cannot keep it within this distance of where it is held
# TOO_FAR and MISSED while the other foot is not held. They are larger, so that this foot waits for the other
# one to land, and the character does not hop.
TOO_FAR_ALONE, MISSED_ALONE = 30.0, 4.0
STEP_FRAMES = 10  # length of a step in frames, a sixth of a second
STEP_HEIGHT = 5.0  # cm by which the sole is off the ground in the middle of a step

# How the feet of C characters are held, kept between frames:
# lock (C, 2): 1 if the toe stays where it landed, 0 if it is where the network predicts it, a number between
# them while the foot is released or steps; hold (C, 2, 2): x and z where the toe is held; step (C, 2): share
# of a step that is done, 0 if the foot does not step; missed (C, 2): cm from where the toe is held to where
# it was drawn, 0 if lock is below 1.
Hold = tuple[Any, Any, Any, Any]


@njit
def hold_foot(
    c: int,
    f: int,
    toe: tuple[float, float],
    contact: float,
    locking: bool,
    shown: Any,
    fastest: float,
    state: Hold,
) -> Any:
    """Advance `state` of foot `f` of character `c`. Returns how far (x, z) to move the network's toe, cm.

    toe: x and z of the network's toe. contact: predicted contact of the toe, 0 to 1. locking: whether feet
    are held at all. shown: (3,) where the toe was drawn in the last frame. fastest: cm that the drawn toe may
    move in this frame. The network's toe never moves faster, so a foot that is behind catches up.
    """
    lock, hold, step, missed = state
    x, z = toe
    away_x, away_z = hold[c, f, 0] - x, hold[c, f, 1] - z  # from the network's toe to where it is held
    if not locking:
        lock[c, f], step[c, f] = 0.0, 0.0
        return 0.0, 0.0
    far = np.sqrt(away_x * away_x + away_z * away_z)
    if lock[c, f] < 1.0 and far > TOO_FAR_ALONE:
        # While the foot is in the air, the network's foot may move by a metre. The hold then follows it.
        away_x, away_z = away_x * TOO_FAR_ALONE / far, away_z * TOO_FAR_ALONE / far
        hold[c, f, 0], hold[c, f, 1] = x + away_x, z + away_z
    if step[c, f] > 0.0:
        step[c, f] += 1.0 / STEP_FRAMES
        if step[c, f] > 1.0 - 1e-6:
            step[c, f], lock[c, f] = 0.0, 0.0
    if step[c, f] == 0.0:
        if contact < LOCK_AT:
            lock[c, f] = max(0.0, lock[c, f] - RELEASE)
        elif lock[c, f] < 1.0:
            # Hold the foot where it is shown now, so that renewed contact does not pull it back.
            away_x, away_z = limited_shift(lock[c, f] * away_x, lock[c, f] * away_z, x, z, shown, fastest)
            hold[c, f, 0], hold[c, f, 1] = x + away_x, z + away_z
            lock[c, f] = 1.0
        else:
            other_held = lock[c, 1 - f] == 1.0
            too_far, too_missed = (TOO_FAR, MISSED) if other_held else (TOO_FAR_ALONE, MISSED_ALONE)
            if far >= too_far or missed[c, f] > too_missed:
                step[c, f] = 1.0 / STEP_FRAMES
    if step[c, f] > 0.0:  # lock falls from 1 to 0, slowly at both ends
        lock[c, f] = 1.0 - step[c, f] * step[c, f] * (3.0 - 2.0 * step[c, f])
    return limited_shift(lock[c, f] * away_x, lock[c, f] * away_z, x, z, shown, fastest)


@njit
def limited_shift(by_x: float, by_z: float, x: float, z: float, shown: Any, fastest: float) -> Any:
    """The shift (by_x, by_z) of a toe at x, z, cm, changed if the toe would move too far.

    The shifted toe is at most `fastest` away from where it was drawn in the last frame, `shown` (3,).
    """
    to_x, to_z = x + by_x - shown[0], z + by_z - shown[2]
    far = np.sqrt(to_x * to_x + to_z * to_z)
    if far <= fastest:
        return by_x, by_z
    return shown[0] + to_x * fastest / far - x, shown[2] + to_z * fastest / far - z


@njit
def step_rise(done: float, above: float) -> float:
    """How far to raise a foot that has done the share `done` of a step, cm.

    The height over the step is a parabola, STEP_HEIGHT in the middle. above: cm by which the network's foot
    is above the ground already; negative if it is in the ground.
    """
    return max(4.0 * STEP_HEIGHT * done * (1.0 - done) - max(above, 0.0), 0.0)


@njit
def note_missed(c: int, f: int, x: float, z: float, state: Hold) -> None:
    """Store in `missed` how far the toe of a held foot is from where it is held, cm; 0 for a foot not held.

    x, z: where the toe is drawn in this frame.
    """
    lock, hold, _, missed = state
    missed[c, f] = 0.0
    if lock[c, f] == 1.0:
        missed[c, f] = np.sqrt((hold[c, f, 0] - x) ** 2 + (hold[c, f, 1] - z) ** 2)
