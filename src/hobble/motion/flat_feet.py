"""Finds how feet are turned when they stand flat, from the motion alone.

The ball of a standing foot is low and slow. Meanwhile the heel comes down and goes up again, so the foot is
flat when it is least steep, apart from the first moments. A runner's heel never comes all the way down.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hobble.core import quat
from hobble.core.quat import Array
from hobble.motion.body import SIDES
from hobble.motion.body_sample import BodySample
from hobble.motion.orient import mean, unit
from hobble.motion.spine import SHORT

UP, AHEAD, LEFT = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
STANCE = 0.2  # the foot stands in this share of the frames, those with the lowest and slowest ball
LEAST_STEEP = (10.0, 30.0)  # percentiles: a standing foot is flat if its steepness is between them
FEWEST = 3  # frames
SLOW = 0.5  # leg lengths a second: a slower ball stands
RUNS = 0.3  # it is a run if the ball stands in a smaller share of frames; CMU's walks have at least .41
# How much steeper than flat a runner's standing foot is. On 19 runs of CMU, relative to their zero poses, the
# mean is 6.8 degrees and the range 4.0 to 9.2. On 50 walks the mean is .7.
RAISED = np.radians(6.8)
UNLIKE = np.radians(2.5)
APART = 10.0  # degrees: if the two feet differ by more, neither is trusted
UPRIGHT = 0.6  # least height of the hips above a standing foot, in leg lengths


def flat_feet(seen: BodySample) -> dict[int, Array]:
    """Frames (4,) of ankles and balls that show how they are turned while the feet are flat.

    Both feet of a rig have about the same build, so a limping foot is corrected by the other. The steepness
    of each is moved half-way to the mean of both, but by no more than UNLIKE.
    """
    tilts = {side: _steepness(seen, side) for side in SIDES}
    frames: dict[int, Array] = {}
    known = [tilt for tilt in tilts.values() if tilt is not None]
    both = float(np.mean(known)) - (RAISED if runs(seen) else 0.0) if known else 0.0
    for side in SIDES:
        tilt = tilts[side]
        own = 0.0 if tilt is None else float(np.clip(0.5 * (tilt - np.mean(known)), -UNLIKE, UNLIKE))
        more = quat.from_axis_angle(LEFT, np.array(both + own - tilt if tilt is not None else 0.0))
        flat = flat_frames(seen, side)
        level = quat.between(AHEAD, unit(_ahead(seen, side)[flat] * [1, 0, 1]))
        for joint in seen.body.legs[side][2:]:
            if joint is not None:
                found = mean(quat.mul(quat.inv(seen.turned[flat, joint]), level))
                frames[joint] = quat.mul(found, quat.inv(more))
    return frames


def doubt(seen: BodySample) -> str | None:
    """A sentence on what is uncertain about feet that are known from motion alone, or None."""
    tilts = [np.degrees(tilt) for side in SIDES if (tilt := _steepness(seen, side)) is not None]
    if len(tilts) < len(SIDES):
        return (
            "Neither a joint nor a zero pose shows how its feet are turned: toes and ankles may lie some "
            "centimetres off."
        )
    if abs(tilts[0] - tilts[1]) > APART:
        return (
            f"Its feet stand at different angles ({tilts[0]:.0f} and {tilts[1]:.0f} degrees), as on uneven "
            "ground, and no zero pose tells how they are turned: the figure may stand 3 cm too high or low."
        )
    return None


def runs(seen: BodySample) -> bool:
    """Whether the figure runs, so that its feet hardly stand."""
    slow = [
        seen.speeds[:, _ball(seen, side)] < SLOW * seen.length(*seen.body.legs[side][:3]) for side in SIDES
    ]
    return bool(np.mean(slow) < RUNS)


def flat_frames(seen: BodySample, side: str) -> NDArray[np.integer]:
    """The frames in which a foot is flat on the ground, as far as there are any."""
    ball = _ball(seen, side)
    order = _rank(seen.speeds[:, ball]) + _rank(seen.at[:, ball, 1])
    stance = np.argsort(order)[: max(FEWEST + 2, round(STANCE * len(order)))]
    steep = _steep(_ahead(seen, side)[stance])
    low, high = np.percentile(steep, LEAST_STEEP)
    flat = stance[(steep >= low) & (steep <= high)]
    return flat if len(flat) >= FEWEST else stance[np.argsort(steep)[:FEWEST]]


def stands(seen: BodySample, side: str) -> bool:
    """Whether the body is upright while that foot is flat."""
    hip, knee, heel, _ = seen.body.legs[side]
    flat = flat_frames(seen, side)
    height = np.median(seen.at[flat, hip, 1] - seen.at[flat, heel, 1])
    return bool(height > UPRIGHT * seen.length(hip, knee, heel))


def _steepness(seen: BodySample, side: str) -> float | None:
    """Radians by which the foot's bone points down when it is flat, or None without a bone."""
    heel, toe = seen.body.legs[side][2:]
    if toe is None:
        return None
    flat = flat_frames(seen, side)
    return float(np.median(_steep(seen.at[flat, toe] - seen.at[flat, heel])))


def _ball(seen: BodySample, side: str) -> int:
    heel, toe = seen.body.legs[side][2:]
    return heel if toe is None else toe


def _ahead(seen: BodySample, side: str) -> Array:
    """(S, 3) direction of a foot: along its bone, to its end site, or where the hips face."""
    heel, toe = seen.body.legs[side][2:]
    if toe is not None:
        return seen.at[:, toe] - seen.at[:, heel]
    if (site := seen.ends[side]) is not None and np.linalg.norm(site) > SHORT:
        return quat.rotate(seen.turned[:, heel], np.array(site))
    ahead = np.cross(seen.hips_left, UP)
    return quat.rotate(seen.turned[:, heel], seen.local(heel, ahead))


def _steep(ahead: Array) -> Array:
    return np.arctan2(-ahead[:, 1], np.linalg.norm(ahead[:, [0, 2]], axis=-1))


def _rank(values: Array) -> NDArray[np.integer]:
    return np.argsort(np.argsort(values))
