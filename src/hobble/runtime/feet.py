"""Holds the feet on the ground until the network lifts them or they have to step, and bends the legs to them.

Below, "the network's foot" is the foot where the network predicts it. A network often predicts contact while
it moves the foot: for a few frames at the end of a stance, and for seconds when the foot glides. A held foot
then falls behind the network's foot. No foot can be held for ever, and a foot that is let go while it
stands drags over the ground. So the runtime makes it step: the foot is lifted, swings to the network's foot
and lands there.
"""

from typing import Any

import numpy as np
from numba.extending import register_jitable

from hobble.core.compiled import njit
from hobble.core.skeleton import Skeleton
from hobble.models.network import Network
from hobble.runtime.leg import MOST_ADDED, LastFrame, bend_leg, hold_back, turn_rotation, turn_vector

# Holds the feet where they landed.

# A foot is held from this predicted contact on. With .8, as in the runtime of Holden et al. (2017), a foot
# slides 4.8 cm a step before it is held and after it is released.
LOCK_AT = 0.5
# After contact, `lock` (1: held, 0: free) falls by this much in each frame. The foot follows slowly at both
# ends. When it followed as the lock falls, the legs jerked more than twice as much as people's.
RELEASE = 0.125
TOO_FAR = 20.0  # cm; a held foot steps if the network's foot is this far away from it
MISSED = 1.0  # cm; a held foot steps if its leg cannot keep it within this distance of where it is held
# TOO_FAR and MISSED while the other foot is not held. They are larger, so that this foot waits for the other
# one to land, and the character does not hop.
TOO_FAR_ALONE, MISSED_ALONE = 30.0, 4.0
STEP_FRAMES = 14  # length of a step in frames, a quarter of a second
STEP_HEIGHT = 5.0  # cm by which the sole is off the ground in the middle of a step

# How the feet of C characters are held, kept between frames:
# lock (C, 2): 1 if the toe stays where it landed, 0 if it is where the network predicts it, a number between
# them while the foot is released or steps; hold (C, 2, 2): x and z where the toe is held; step (C, 2): share
# of a step that is done, 0 if the foot does not step; missed (C, 2): cm from where the toe is held to where
# it was drawn, 0 if lock is below 1.
Hold = tuple[Any, Any, Any, Any]


@register_jitable
def held_share(lock: Any) -> Any:
    """How much of the way from the network's toe to where it is held is shown. See `Hold` for lock."""
    return lock * lock * (3.0 - 2.0 * lock)


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
            share = held_share(lock[c, f])
            away_x, away_z = limited_shift(share * away_x, share * away_z, x, z, shown, fastest)
            hold[c, f, 0], hold[c, f, 1] = x + away_x, z + away_z
            lock[c, f] = 1.0
        else:
            other_held = lock[c, 1 - f] == 1.0
            too_far, too_missed = (TOO_FAR, MISSED) if other_held else (TOO_FAR_ALONE, MISSED_ALONE)
            if far >= too_far or missed[c, f] > too_missed:
                step[c, f] = 1.0 / STEP_FRAMES
    if step[c, f] > 0.0:
        lock[c, f] = 1.0 - step[c, f]
    share = held_share(lock[c, f])
    return limited_shift(share * away_x, share * away_z, x, z, shown, fastest)


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


# Places feet: holds a foot in contact where it landed, and bends the leg so that the foot gets there.
#
# Below, "the network's foot" is the foot where the network predicts it. The foot lift is how far, in cm, foot
# placement raises one foot. The body lift is how far it raises the whole body.


HEIGHT_MIX = 0.5  # a foot comes down by this share of the way that is left, each frame; up it goes at once
# Largest change of the foot lift, cm a frame. It is needed because a network may predict contact while the
# foot is at knee height.
FASTEST_LIFT = 8.0
# A held foot may stretch its leg to this share of the leg's full length, or as far as the network stretches
# it if that is further. Instead of stretching more, a leg behind the hip raises its heel, and any other, as
# in steps to the side or backward, pulls the hips down. Without this rule, holding a foot 5 cm behind the
# network's foot straightens a knee that is bent by 26 degrees, and a leg that should stay stiff bends and
# stretches. Healthy legs snapped straight in steps backward.
STRETCH = 0.96
# The heel begins to rise as the toe comes within UNDER cm ahead of the hip, and the rule applies in full
# BEHIND cm later. A foot further ahead stays flat.
UNDER, BEHIND = 8.0, 10.0
MOST_SINK = 6.0  # cm that the hips sink at most
SINK_KEPT = 0.85  # they come up again gradually: this share is left in the next frame
BODY_MIX = 0.15  # a share of the way that is left, each frame, for the body lift, up and down
BODY_FREE = 3.0  # cm that standing feet may be off the ground before the body is raised or lowered
BODY_MIN_CONTACT = 0.3  # if the contacts of both feet sum to less, the feet do not decide the body's height
SOLE = (5.0, 4.0)  # height of heel and toe joint above the ground in a standing foot, cm
# A held foot is lowered only if its joints are more than this many cm above SOLE. Skeletons differ in how
# high these joints are.
FLOATING = 3.0
# Where steps differ, see `hobble.runtime.variation`: the height of a heel above the ground, in cm, from which
# its knee bends as much more as it should, and the bends, in radians, between which it is changed.
BENDS_ABOVE, BENT, MOST_BENT = 10.0, 0.1, 2.5
FOOT, TOES = 1, 2  # the part of a foot to which a joint belongs, see `foot_parts`; 0: neither


# Groups of arrays for compiled functions, which unpack them into names.
#
# joints (2, 4), see `leg_joints`; parts (2, J), see `foot_parts`; sole (2,), see `sole_heights`; ahead (3,),
# see `rest_facing`; fastest: a drawn joint of a leg may move at most this many cm in a frame. Both
# `leg_joints` and `rest_facing` are in `hobble.runtime.leg`.
Legs = tuple[Any, Any, Any, Any, float]
# The state of the feet between frames: held, see `Hold`; lift (C, 2), the foot lift; added (C, 2, 2, 4),
# rotations added to thigh and shank of each leg; shown (C, 2, 3, 3), knee, heel and toe of each leg as they
# were drawn; root_height (C,), mean ground height on the path; body_lift (C,); hips_sink (C,), cm by which
# held feet pull the hips down; more (C, 2), radians that each knee bends more in the air. The heights in
# `shown` are above root_height + body_lift, because the whole body may rise in a frame.
Feet = tuple[Hold, Any, Any, Any, Any, Any, Any, Any]


def sole_heights(network: Network, legs: np.ndarray) -> np.ndarray:
    """(2,) heel and toe height below which a foot is in the ground, cm.

    They are those of the pose in which a character starts, or SOLE if the file has none. The network's mean
    pose gives the mean heights of heel and toe. They are larger than in a standing foot, because feet are in
    the air half of the time. 60% of them is less than in any standing foot, so it is the most.
    """
    joints, facts = network.layout.y_joint_position, network.training_facts
    mean = network.y_mean[joints].reshape(-1, 3)[legs[:, 2:], 1].mean(axis=0)
    at_start = None if facts is None else facts.start_y[joints].reshape(-1, 3)[legs[:, 2:], 1].min(axis=0)
    return np.minimum(SOLE if at_start is None else at_start, 0.6 * mean).astype(float)


@njit
def leg_squares(position: Any, hip: int, knee: int, heel: int) -> tuple[float, float, float]:
    """Squares of the lengths of thigh and shank, and of the distance from hip to heel. position: (J, 3)."""
    upper, lower, apart = 0.0, 0.0, 0.0
    for i in range(3):
        upper += (position[knee, i] - position[hip, i]) ** 2
        lower += (position[heel, i] - position[knee, i]) ** 2
        apart += (position[heel, i] - position[hip, i]) ** 2
    return upper, lower, apart


@njit
def allowed_square(position: Any, hip: int, knee: int, heel: int) -> float:
    """Square of the distance from hip to heel, cm, to which a held foot may stretch its leg, see STRETCH."""
    upper, lower, before = leg_squares(position, hip, knee, heel)
    return max(before, (STRETCH * (np.sqrt(upper) + np.sqrt(lower))) ** 2)


@njit
def raise_heel(position: Any, hip: int, knee: int, heel: int, toe: int, shift: Any, roll: Any) -> None:
    """Raise the heel of a foot that `shift` moves behind the hip, so that the leg obeys STRETCH.

    position: (J, 3) of the pose, not changed. shift: (3,) how far the whole foot moves, cm. The foot turns
    about its toe, by MOST_ADDED at most. This rotation is written to `roll` (4,), once the identity, and the
    heel's movement is added to `shift`. A foot ahead of the hip by UNDER stays flat.
    """
    most, needed = allowed_square(position, hip, knee, heel), 0.0  # squares of the distance, cm
    for i in range(3):
        needed += (position[heel, i] + shift[i] - position[hip, i]) ** 2
    # The foot from heel to toe has the horizontal direction (fx, fz) and length `along`. The heel is `high`
    # above the toe.
    fx, fz = position[toe, 0] - position[heel, 0], position[toe, 2] - position[heel, 2]
    along, high = np.sqrt(fx * fx + fz * fz), position[heel, 1] - position[toe, 1]
    if needed <= most or along < 1e-6:
        return
    fx, fz = fx / along, fz / along
    # The shifted toe is at (wx, up, wz) from the hip, and `ahead` of it in the direction of the foot.
    wx, wz = position[toe, 0] + shift[0] - position[hip, 0], position[toe, 2] + shift[2] - position[hip, 2]
    ahead, up = wx * fx + wz * fz, position[toe, 1] + shift[1] - position[hip, 1]
    if ahead >= UNDER:
        return
    most += max(1.0 + (ahead - UNDER) / BEHIND, 0.0) * (needed - most)
    # Find the angle of the turn about the toe after which the squared distance from hip to heel is `most`.
    # Before the turn, the heel is at (-along, high) from the toe. This leads to the equation
    # cosine * cos(angle) + sine * sin(angle) = right.
    cosine, sine = up * high - ahead * along, ahead * high + up * along
    right = 0.5 * (most - wx * wx - up * up - wz * wz - along * along - high * high)
    right = min(max(right / np.sqrt(cosine * cosine + sine * sine), -1.0), 1.0)
    angle = min(max(np.arctan2(sine, cosine) + np.arccos(right), 0.0), MOST_ADDED)
    forward = along * (1 - np.cos(angle)) + high * np.sin(angle)
    shift[0] += forward * fx
    shift[1] += along * np.sin(angle) - high * (1 - np.cos(angle))
    shift[2] += forward * fz
    roll[0], roll[1], roll[3] = np.cos(angle / 2), np.sin(angle / 2) * fz, -np.sin(angle / 2) * fx


@njit
def needed_sink(position: Any, leg: Any, hold: Any, rise: float) -> float:
    """By how much the hips have to sink, cm, so that a held foot obeys STRETCH.

    position: (J, 3) of the pose. leg: (4,) hip, knee, heel and toe joint. hold: (2,) how far the foot moves
    along x and z, rise: how far it moves up, cm.
    """
    hip, knee, heel, toe = leg[0], leg[1], leg[2], leg[3]
    most = allowed_square(position, hip, knee, heel)
    # The held heel is at (wx, wz) from the hip, `down` below it.
    wx, wz = position[heel, 0] + hold[0] - position[hip, 0], position[heel, 2] + hold[1] - position[hip, 2]
    down, across = position[hip, 1] - position[heel, 1] - rise, wx * wx + wz * wz
    fx, fz = position[toe, 0] - position[heel, 0], position[toe, 2] - position[heel, 2]
    along = np.sqrt(fx * fx + fz * fz)
    if across + down * down <= most or along < 1e-6:
        return 0.0
    ahead = (wx * fx + wz * fz) / along + along  # as in `raise_heel`
    share = min(max(1.0 + (ahead - UNDER) / BEHIND, 0.0), 1.0)
    return share * min(max(down - np.sqrt(max(most - across, 0.0)), 0.0), MOST_SINK)


@njit
def carry_foot(
    position: Any,
    rotation: Any,
    parts: Any,
    heel: int,
    toe: int,
    old_heel: tuple[float, float, float],
    roll: Any,
) -> None:
    """Move a foot along with its heel, which has moved away from `old_heel` (x, y, z), and turn it by `roll`.

    parts: (J,) which joints belong to the foot, see `foot_parts`. roll: (4,) rotation. The toes move, but do
    not turn.
    """
    x, y, z = old_heel
    # (tx, ty, tz): first from the new heel to the new toe, then the toe's movement.
    tx, ty, tz = turn_vector(roll, position[toe, 0] - x, position[toe, 1] - y, position[toe, 2] - z)
    tx += position[heel, 0] - position[toe, 0]
    ty += position[heel, 1] - position[toe, 1]
    tz += position[heel, 2] - position[toe, 2]
    turn_rotation(roll, rotation[heel])
    for j in range(position.shape[0]):
        if parts[j] == TOES:
            position[j, 0] += tx
            position[j, 1] += ty
            position[j, 2] += tz
        elif parts[j] == FOOT:
            px, py, pz = turn_vector(roll, position[j, 0] - x, position[j, 1] - y, position[j, 2] - z)
            position[j, 0] = position[heel, 0] + px
            position[j, 1] = position[heel, 1] + py
            position[j, 2] = position[heel, 2] + pz
            turn_rotation(roll, rotation[j])


@njit
def hold_toes_back(position: Any, parts: Any, toe: int, last: LastFrame) -> None:
    """Limit how far the toe moves in a frame, and move the joints below it along.

    The limit is needed because a foot that turns may move its toe faster than its heel. parts: (J,) which
    joints belong to the toes, see `foot_parts`. last: the leg in the last frame.
    """
    shown, base, fastest = last
    x, y, z = position[toe, 0], position[toe, 1], position[toe, 2]
    if hold_back(position[toe], shown[2], base, fastest):
        x, y, z = position[toe, 0] - x, position[toe, 1] - y, position[toe, 2] - z  # movement of the toe
        for j in range(position.shape[0]):
            if parts[j] == TOES and j != toe:
                position[j, 0] += x
                position[j, 1] += y
                position[j, 2] += z


@njit
def sole_depth(position: Any, heel: int, toe: int, ground_heel: float, ground_toe: float, sole: Any) -> float:
    """How deep a foot of a pose (J, 3) is in the ground, cm; negative if it is above.

    ground_heel, ground_toe: height of the ground under them. sole: (2,) see `sole_heights`.
    """
    heel_depth = ground_heel + sole[0] - position[heel, 1]
    toe_depth = ground_toe + sole[1] - position[toe, 1]
    return max(heel_depth, toe_depth)


@njit
def carry_body(
    contacts: Any,
    ground: Any,
    hips: int,
    hips_range: tuple[float, float, float],
    predicted: Any,
    legs: Legs,
    lift: Any,
    position: Any,
) -> None:
    """Raise or lower whole bodies, positions (C, J, 3), so that they stand on the ground under them.

    The network predicts a body that stands at the mean ground height along two seconds of path. On a hill a
    few metres long, this height is 30 cm above or below the ground under the feet. A network trained on
    gentler hills does not correct such a difference, and legs fold or hang in the air. So the standing feet
    decide the height of the body, and the hips stay in the range of heights above the ground that they had in
    training.

    contacts: see `place_feet`. ground: (C, 5) heights under the feet as in `place_feet`, then under the hips.
    hips: index of the hips joint. hips_range: lowest and highest height of this joint, cm above the ground,
    and the height above which it stays unless the network predicts a lower one, as when it crouches.
    predicted: (C,) the predicted height of this joint, cm above the mean ground.
    lift: (C,) the body lift, cm, kept between frames.
    """
    joints, _, sole, _, _ = legs
    for c in range(position.shape[0]):
        rises, weight = 0.0, 0.0
        for f in range(2):
            under = ground[c, 2 * f], ground[c, 2 * f + 1]
            rise = sole_depth(position[c], joints[f, 2], joints[f, 3], under[0], under[1], sole)
            stands = min(max(contacts[c, 2 * f], contacts[c, 2 * f + 1], 0.0), 1.0)
            # Only what is beyond BODY_FREE counts.
            rises += stands * (max(rise - BODY_FREE, 0.0) + min(rise + BODY_FREE, 0.0))
            weight += stands
        if weight > BODY_MIN_CONTACT:
            lift[c] += BODY_MIX * (rises / weight - lift[c])
        above = position[c, hips, 1] - ground[c, 4]
        lowest = max(hips_range[0], min(hips_range[2], predicted[c]))
        lift[c] = min(max(lift[c], lowest - above), hips_range[1] - above)
        for j in range(position.shape[1]):
            position[c, j, 1] += lift[c]


@njit
def heel_of_bend(position: Any, hip: int, knee: int, heel: int, more: float) -> tuple[float, float, float]:
    """How far (x, y, z) the heel of a pose (J, 3) moves, toward the hip, if the knee bends by `more` radians.

    If `more` is negative, it moves away from the hip, but the knee stays bent by BENT, if it was.
    """
    upper, lower, before = leg_squares(position, hip, knee, heel)
    both = 2.0 * np.sqrt(upper * lower)
    if before < 1.0 or both < 1.0:
        return 0.0, 0.0, 0.0
    bent = np.arccos(min(max((before - upper - lower) / both, -1.0), 1.0))
    bent = min(max(bent + more, min(bent, BENT)), max(bent, MOST_BENT))
    share = np.sqrt((upper + lower + both * np.cos(bent)) / before) - 1.0
    x, y, z = position[hip, 0], position[hip, 1], position[hip, 2]
    return share * (position[heel, 0] - x), share * (position[heel, 1] - y), share * (position[heel, 2] - z)


@njit
def place_feet(
    contacts: Any, ground: Any, locking: bool, legs: Legs, feet: Feet, position: Any, rotation: Any
) -> None:
    """Hold feet in contact and keep feet out of the ground. Changes the pose and the state of the feet.

    contacts: (C, 4) predicted, of left heel, left toe, right heel, right toe. 0 is written for a foot that
    the runtime makes step. ground: (C, 4 or more) heights under these four joints. locking: whether feet are
    held at all. position (C, J, 3), rotation (C, J, 4): the pose.
    """
    joints, parts, sole, ahead, fastest = legs
    held, lift, added, shown, root_height, body_lift, hips_sink, more = feet
    lock, hold, step, missed = held
    shift, roll, holds, depths = np.zeros(3), np.zeros(4), np.zeros((2, 2)), np.zeros(2)
    for c in range(position.shape[0]):
        base = root_height[c] + body_lift[c]
        sink = SINK_KEPT * hips_sink[c]
        for f in range(2):
            heel, toe = joints[f, 2], joints[f, 3]
            at = position[c, toe, 0], position[c, toe, 2]
            holds[f, 0], holds[f, 1] = hold_foot(
                c, f, at, contacts[c, 2 * f + 1], locking, shown[c, f, 2], fastest, held
            )
            depths[f] = sole_depth(position[c], heel, toe, ground[c, 2 * f], ground[c, 2 * f + 1], sole)
            sink = max(sink, needed_sink(position[c], joints[f], holds[f], max(depths[f], 0.0)))
        hips_sink[c] = sink  # the feet stay where they are
        for j in range(position.shape[1]):
            position[c, j, 1] -= sink
        for f in range(2):
            hip, knee, heel, toe = joints[f, 0], joints[f, 1], joints[f, 2], joints[f, 3]
            shift[0], shift[2] = holds[f]
            # Lift a foot out of the ground; lower a held foot that floats; raise a foot that steps.
            depth = depths[f]
            x, y, z = 0.0, 0.0, 0.0
            if more[c, f] != 0.0:
                # Only in the air: nothing changes as the foot leaves the ground, and little as it lands.
                near = max(lock[c, f], min(contacts[c, 2 * f + 1] / LOCK_AT, 1.0))
                high = (position[c, heel, 1] - ground[c, 2 * f] - sole[0]) / BENDS_ABOVE
                free = (1.0 - held_share(near)) * held_share(min(max(high, 0.0), 1.0))
                x, y, z = heel_of_bend(position[c], hip, knee, heel, free * more[c, f])
                shift[0], shift[2], depth = shift[0] + x, shift[2] + z, depth - y
            rise = max(depth, 0.0)
            if step[c, f] == 0.0:
                rise += held_share(lock[c, f]) * min(depth + FLOATING, 0.0)
            change = rise - lift[c, f]
            if change < 0.0:
                change *= HEIGHT_MIX
            lift[c, f] += min(max(change, -FASTEST_LIFT), FASTEST_LIFT)
            shift[1] = lift[c, f] + y + sink
            if step[c, f] > 0.0:
                # It leaves the ground slowly, and comes back slowly. The network's may be above it already.
                height = STEP_HEIGHT * (4.0 * step[c, f] * (1.0 - step[c, f])) ** 2
                shift[1] += max(height - max(-depth, 0.0), 0.0)
                contacts[c, 2 * f] = contacts[c, 2 * f + 1] = 0.0
            roll[0], roll[1], roll[2], roll[3] = 1.0, 0.0, 0.0, 0.0
            if lock[c, f] > 0.0:
                raise_heel(position[c], hip, knee, heel, toe, shift, roll)
            old_heel = position[c, heel, 0], position[c, heel, 1], position[c, heel, 2]
            last = shown[c, f], base, fastest
            bend_leg(position[c], rotation[c], joints[f], shift, ahead, added[c, f], last)
            carry_foot(position[c], rotation[c], parts[f], heel, toe, old_heel, roll)
            hold_toes_back(position[c], parts[f], toe, last)
            missed[c, f] = 0.0
            if lock[c, f] == 1.0:
                x, z = hold[c, f, 0] - position[c, toe, 0], hold[c, f, 1] - position[c, toe, 2]
                missed[c, f] = np.sqrt(x**2 + z**2)
            for i in range(3):
                j = joints[f, i + 1]
                shown[c, f, i, 0], shown[c, f, i, 2] = position[c, j, 0], position[c, j, 2]
                shown[c, f, i, 1] = position[c, j, 1] - base


def foot_parts(skeleton: Skeleton, legs: np.ndarray) -> np.ndarray:
    """(2, J) which joints belong to the left foot, and which to the right.

    TOES for the toe joint and the joints below it, FOOT for the other joints below the heel, 0 for all else.
    legs: (2, 4) from `leg_joints`.
    """
    out = np.zeros((2, len(skeleton.joints)), np.int8)
    for f in range(2):
        for j, p in enumerate(skeleton.parents):
            if j == legs[f, 3] or (p >= 0 and out[f, p] == TOES):
                out[f, j] = TOES
            elif p == legs[f, 2] or (p >= 0 and out[f, p]):
                out[f, j] = FOOT
    return out
