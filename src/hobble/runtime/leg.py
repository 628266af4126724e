"""Bends a leg so that its heel moves (two-bone inverse kinematics), with limited turns of thigh and shank."""

from typing import Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.skeleton import Skeleton, rest_positions

# Foot placement adds a rotation to the network's thigh and shank. This is the largest change of that rotation
# in a frame, radians. One frame in 2,000 needs more. Then the foot arrives some frames later. Without the
# limit, legs turned by up to 148 degrees in a frame.
MOST_ADDED = float(np.radians(28))
# Least distance, in cm, by which foot placement puts a knee ahead of the line between hip and heel. In all
# captured clips this distance is 1.6 or more. A predicted knee may cross that line, because positions are
# predicted joint by joint. If the leg then bent to the side of the predicted knee, it would bend backwards.
KNEE_AHEAD = 3.0

# The functions below write vectors out by component, such as x, y, z, because array expressions take seconds
# to compile and allocate memory.

# (shown, base, fastest). shown: (3, 3) positions of a leg's knee, heel and toe as they were drawn in the last
# frame, with heights above `base`. base: height of the body in this frame, cm. fastest: cm that each joint
# may move in a frame.
LastFrame = tuple[Any, float, float]


@njit
def rotation_between(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> Any:
    """The smallest rotation (w, x, y, z) from direction a to b; the identity if they are opposite."""
    # It is the quaternion (|a| |b| + a . b, a x b), normalised.
    w = np.sqrt((ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz)) + ax * bx + ay * by + az * bz
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    norm = np.sqrt(w * w + x * x + y * y + z * z)
    if norm < 1e-9:
        return 1.0, 0.0, 0.0, 0.0
    return w / norm, x / norm, y / norm, z / norm


@njit
def turn_toward(rotation: Any, w: float, x: float, y: float, z: float, most: float) -> bool:
    """Turn `rotation` (4,) in place toward the rotation (w, x, y, z), by `most` radians at most.

    Returns True if it does not reach that rotation because of the limit.
    """
    dot = rotation[0] * w + rotation[1] * x + rotation[2] * y + rotation[3] * z
    if abs(dot) >= np.cos(most / 2):
        rotation[0], rotation[1], rotation[2], rotation[3] = w, x, y, z
        return False
    # Turn by `most` along the shorter way (slerp).
    half = np.arccos(abs(dot))  # half the angle between the two rotations
    keep = np.sin(half - most / 2) / np.sin(half)
    take = np.sin(most / 2) / np.sin(half) * (1.0 if dot >= 0 else -1.0)
    rotation[0], rotation[1] = keep * rotation[0] + take * w, keep * rotation[1] + take * x
    rotation[2], rotation[3] = keep * rotation[2] + take * y, keep * rotation[3] + take * z
    return True


@njit
def turn_vector(by: Any, x: float, y: float, z: float) -> tuple[float, float, float]:
    """The vector (x, y, z) turned by the rotation `by` (4,)."""
    w, a, b, c = by[0], by[1], by[2], by[3]
    p, q, r = 2 * (b * z - c * y), 2 * (c * x - a * z), 2 * (a * y - b * x)
    return x + w * p + b * r - c * q, y + w * q + c * p - a * r, z + w * r + a * q - b * p


@njit
def turn_rotation(by: Any, rotation: Any) -> None:
    """Turn `rotation` (4,) in place by the rotation `by` (4,)."""
    w, x, y, z = by[0], by[1], by[2], by[3]
    a, b, c, d = rotation[0], rotation[1], rotation[2], rotation[3]
    rotation[0] = w * a - x * b - y * c - z * d
    rotation[1] = w * b + x * a + y * d - z * c
    rotation[2] = w * c - x * d + y * a + z * b
    rotation[3] = w * d + x * c - y * b + z * a


@njit
def move_heel(
    position: Any, hip: int, knee: int, heel: int, shift: Any, ahead: tuple[float, float, float], least: float
) -> None:
    """Move the heel of a pose by `shift` (3,), by bending the knee.

    position: (J, 3), changed in place. ahead: the direction in which a straight knee bends. Bone lengths
    stay. The knee keeps bending to the same side, but is at least `least` cm ahead of the line between hip
    and heel. If the target is out of reach, the leg stretches to 99.9% of its length. The knee's angle
    follows from the law of cosines, as in `hobble.core.skeleton.two_bone_knee`. If `shift` is 0 and the knee
    is far enough ahead, nothing changes.
    """
    # Vectors: s shift; h hip; t thigh, from hip to knee; l shank, from knee to heel; a from hip to heel;
    # w from hip to the shifted heel. `upper` and `lower` are the lengths of thigh and shank.
    sx, sy, sz = shift[0], shift[1], shift[2]
    hx, hy, hz = position[hip, 0], position[hip, 1], position[hip, 2]
    tx, ty, tz = position[knee, 0] - hx, position[knee, 1] - hy, position[knee, 2] - hz
    lx, ly, lz = position[heel, 0] - hx - tx, position[heel, 1] - hy - ty, position[heel, 2] - hz - tz
    upper, lower = np.sqrt(tx * tx + ty * ty + tz * tz), np.sqrt(lx * lx + ly * ly + lz * lz)
    ax, ay, az = tx + lx, ty + ly, tz + lz
    wx, wy, wz = ax + sx, ay + sy, az + sz
    before, distance = np.sqrt(ax * ax + ay * ay + az * az), np.sqrt(wx * wx + wy * wy + wz * wz)
    if min(before, distance, upper, lower) < 1e-6:
        return
    ax, ay, az = ax / before, ay / before, az / before
    wx, wy, wz = wx / distance, wy / distance, wz / distance
    distance = min(max(distance, abs(upper - lower) * 1.001 + 1e-6), (upper + lower) * 0.999)
    # The angle at the hip between w and the new thigh.
    cosine = (upper * upper + distance * distance - lower * lower) / (2 * upper * distance)
    cosine = min(max(cosine, -1.0), 1.0)
    # o: from the line between hip and heel to the knee. f: the part of `ahead` across this line.
    along = tx * ax + ty * ay + tz * az
    ox, oy, oz = tx - along * ax, ty - along * ay, tz - along * az
    along = ahead[0] * ax + ahead[1] * ay + ahead[2] * az
    fx, fy, fz = ahead[0] - along * ax, ahead[1] - along * ay, ahead[2] - along * az
    size = max(np.sqrt(fx * fx + fy * fy + fz * fz), 1e-6)
    more = max(least - (ox * fx + oy * fy + oz * fz) / size, 0.0)
    if more == 0.0 and abs(sx) + abs(sy) + abs(sz) < 1e-9:
        return
    ox, oy, oz = ox + more * fx / size, oy + more * fy / size, oz + more * fz / size
    # Turn o by the smallest rotation from a to w. If the direction of the knee were computed from the new leg
    # alone, the knee might bend backwards.
    factor = (ox * wx + oy * wy + oz * wz) / max(1 + ax * wx + ay * wy + az * wz, 1e-6)
    ox, oy, oz = ox - factor * (ax + wx), oy - factor * (ay + wy), oz - factor * (az + wz)
    size = np.sqrt(ox * ox + oy * oy + oz * oz)
    if size < 1e-6:
        return
    sine = np.sqrt(1 - cosine * cosine) / size
    position[knee, 0] = hx + upper * (wx * cosine + ox * sine)
    position[knee, 1] = hy + upper * (wy * cosine + oy * sine)
    position[knee, 2] = hz + upper * (wz * cosine + oz * sine)
    position[heel, 0] = hx + wx * distance
    position[heel, 1] = hy + wy * distance
    position[heel, 2] = hz + wz * distance


@njit
def hold_back(at: Any, shown: Any, base: float, fastest: float) -> bool:
    """Move the point `at` (3,) until it is at most `fastest` away from where it was drawn in the last frame.

    shown, base, fastest: see `LastFrame`, but `shown` (3,) is of this point only. Returns whether the point
    was moved.
    """
    x, y, z = at[0] - shown[0], at[1] - shown[1] - base, at[2] - shown[2]
    far = np.sqrt(x * x + y * y + z * z)
    if far <= fastest:
        return False
    share = 1.0 - fastest / far
    at[0], at[1], at[2] = at[0] - share * x, at[1] - share * y, at[2] - share * z
    return True


@njit
def bend_leg(
    position: Any, rotation: Any, leg: Any, shift: Any, ahead: Any, added: Any, last: LastFrame
) -> None:
    """Move the heel by `shift` (3,), see `move_heel`, but change the rotations `added` by MOST_ADDED at most.

    leg: (4,) hip, knee, heel and toe joint. ahead: (3,) the direction in which a straight knee bends in the
    rest pose. added: (2, 4) rotations that the last frame added to the network's thigh and shank. Those of
    this frame replace them. last: the leg in the last frame. Knee and heel move by a limited distance in a
    frame, so the heel may need several frames to reach its target.
    """
    # Vectors: h hip; k knee; t and l predicted thigh and shank.
    shown, base, fastest = last
    hip, knee, heel = leg[0], leg[1], leg[2]
    hx, hy, hz = position[hip, 0], position[hip, 1], position[hip, 2]
    kx, ky, kz = position[knee, 0], position[knee, 1], position[knee, 2]
    tx, ty, tz = kx - hx, ky - hy, kz - hz
    lx, ly, lz = position[heel, 0] - kx, position[heel, 1] - ky, position[heel, 2] - kz
    ahead_now = turn_vector(rotation[hip], ahead[0], ahead[1], ahead[2])
    move_heel(position, hip, knee, heel, shift, ahead_now, KNEE_AHEAD)
    kx, ky, kz = position[knee, 0], position[knee, 1], position[knee, 2]
    w, x, y, z = rotation_between(tx, ty, tz, kx - hx, ky - hy, kz - hz)
    limited = turn_toward(added[0], w, x, y, z, MOST_ADDED)
    w, x, y, z = rotation_between(
        lx, ly, lz, position[heel, 0] - kx, position[heel, 1] - ky, position[heel, 2] - kz
    )
    limited |= turn_toward(added[1], w, x, y, z, MOST_ADDED)
    if limited:
        x, y, z = turn_vector(added[0], tx, ty, tz)
        kx, ky, kz = hx + x, hy + y, hz + z
        position[knee, 0], position[knee, 1], position[knee, 2] = kx, ky, kz
        x, y, z = turn_vector(added[1], lx, ly, lz)
        position[heel, 0], position[heel, 1], position[heel, 2] = kx + x, ky + y, kz + z
    limited = hold_back(position[knee], shown[0], base, fastest)
    limited |= hold_back(position[heel], shown[1], base, fastest)
    if limited:  # the rotations that fit the limited positions
        kx, ky, kz = position[knee, 0], position[knee, 1], position[knee, 2]
        sx, sy, sz = position[heel, 0] - kx, position[heel, 1] - ky, position[heel, 2] - kz
        kx, ky, kz = kx - hx, ky - hy, kz - hz
        added[0, 0], added[0, 1], added[0, 2], added[0, 3] = rotation_between(tx, ty, tz, kx, ky, kz)
        added[1, 0], added[1, 1], added[1, 2], added[1, 3] = rotation_between(lx, ly, lz, sx, sy, sz)
    turn_rotation(added[0], rotation[hip])
    turn_rotation(added[1], rotation[knee])


def leg_joints(skeleton: Skeleton) -> np.ndarray:
    """(2, 4) hip, knee, heel and toe joints of the left leg, then of the right."""
    parts = ("hip", "knee", "heel", "toe")
    return np.array([[skeleton.role(f"{side}_{p}") for p in parts] for side in ("left", "right")])


def rest_facing(skeleton: Skeleton) -> np.ndarray:
    """(3,) the direction in which the body faces in the rest pose. Straight knees bend in this direction."""
    rest, legs = rest_positions(skeleton), leg_joints(skeleton)
    left, down = rest[legs[0, 0]] - rest[legs[1, 0]], (rest[legs[:, 2]] - rest[legs[:, 0]]).sum(axis=0)
    ahead = np.cross(down, left)
    return np.asarray(ahead / np.linalg.norm(ahead), float)
