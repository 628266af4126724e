"""How clean and how natural motion is, by measures that the field publishes. No network and no labels needed.

Positions are in cm, 60 frames a second, Y up. F is the number of frames, P that of points. The four points of
the feet are the joints of left heel, left toe, right heel and right toe. A joint of a standing foot lies some
centimetres above the ground. This is its standing height, which differs from rig to rig. Clearances are
heights above it.
"""

from collections.abc import Sequence

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.motion.root import facing_directions

FPS = 60
FOOT_POINTS = ("left_heel", "left_toe", "right_heel", "right_toe")
# Roles whose positions describe a pose, on every rig.
LIMBS = ("shoulder", "elbow", "wrist", "knee", "heel", "toe")
BODY = ("hips", "neck", "head", *(f"{side}_{part}" for part in LIMBS for side in ("left", "right")))
SKATING_BELOW = 2.5  # cm: higher points do not skate (H of Zhang et al. 2018)
STILL = 0.4  # cm a frame: a slower point of a foot may be standing
DEEP = 1.0  # cm: a foot that is deeper in the ground than this is seen
WINDOW, STRIDE, POSES = 60, 15, 5  # frames of a window, frames between windows, poses taken of a window
COMPONENTS = 24  # principal components of the windows that are compared


def joints_with(skeleton: Skeleton, roles: Sequence[str]) -> list[int]:
    """Indices of the joints with these roles."""
    return [skeleton.role(role) for role in roles]


def horizontal_speed(points: Array) -> Array:
    """(F - 1, P) cm a frame over the ground. points: (F, P, 3)."""
    return np.linalg.norm(np.diff(points[..., ::2], axis=0), axis=-1)


def standing_heights(feet: Array) -> Array:
    """(4,) heights of the points of standing feet in a clip, cm: for each point the 25th percentile where it
    is still, since a heel is also still on raised toes. A point that is never still gets its lowest height.

    feet: (F, 4, 3).
    """
    heights, still = feet[1:, :, 1], horizontal_speed(feet) < STILL
    return np.array(
        [
            np.percentile(heights[still[:, p], p], 25) if still[:, p].any() else heights[:, p].min()
            for p in range(heights.shape[1])
        ]
    )


def skating(points: Array, standing: Array | float) -> Array:
    """(F - 1, P) how far each point skates over the ground from one frame to the next, cm.

    After Zhang, Starke, Komura, Saito (2018), a horizontal movement v counts as
    v (2 - 2^(h / SKATING_BELOW)): all of it on the ground, none of it at SKATING_BELOW. h is the clearance,
    clipped to 0 .. SKATING_BELOW. Of the clearances before and after the movement, the larger is taken.
    points: (F, P, 3). standing: (P,) or one height.
    """
    height = np.maximum(points[1:, :, 1], points[:-1, :, 1]) - standing
    return np.asarray(
        horizontal_speed(points) * (2.0 - 2.0 ** (np.clip(height, 0.0, SKATING_BELOW) / SKATING_BELOW))
    )


def floating(feet: Array, standing: Array) -> float:
    """Mean clearance of the lowest point of the feet in frames in which it is still, cm, at least 0.

    A point that hangs still in the air carries a body that floats. In the flight of a run no point is still.
    nan if no point is ever still. feet: (F, 4, 3).
    """
    clearance = feet[1:, :, 1] - standing
    lowest = clearance.argmin(axis=1)[:, None]
    still = np.take_along_axis(horizontal_speed(feet), lowest, axis=1)[:, 0] < STILL
    height = np.take_along_axis(clearance, lowest, axis=1)[:, 0]
    return float(np.maximum(height[still], 0.0).mean()) if still.any() else float("nan")


def penetration(feet: Array, standing: Array) -> tuple[float, float]:
    """Mean depth of the deepest point of the feet below its standing height, cm, and the share of frames in
    which it is deeper than DEEP. feet: (F, 4, 3).
    """
    depth = np.maximum(0.0, (standing - feet[..., 1]).max(axis=1))
    return float(depth.mean()), float((depth > DEEP).mean())


def jerk(points: Array) -> float:
    """Mean size of the third derivative of the points' positions, m/s^3. points: (F, P, 3), F >= 4."""
    return float(np.linalg.norm(np.diff(points, n=3, axis=0), axis=-1).mean() * FPS**3 / 100)


def joint_update(rotations: Array) -> float:
    """Mean rotation of a joint from one frame to the next, degrees (Zhang et al. 2018, table 3).

    rotations: (F, J, 4) quaternions relative to the parent.
    """
    return float(np.degrees(quat.angle(rotations[:-1], rotations[1:])).mean())


def contact_speed(feet: Array, standing: Array) -> float:
    """Mean speed of the points of feet that touch the ground over their largest speed (Starke et al. 2022).

    The largest speed is the 99.9th percentile over all frames. A point touches the ground below DEEP. nan if
    none does. feet: (F, 4, 3).
    """
    speed, down = horizontal_speed(feet), feet[1:, :, 1] - standing < DEEP
    largest = np.percentile(speed, 99.9)
    return float(speed[down].mean() / largest) if down.any() and largest > 0 else float("nan")


def window_features(skeleton: Skeleton, positions: Array) -> Array:
    """(N, D) one row for each WINDOW of positions (F, J, 3), in leg lengths; N is 0 if F is too small.

    A row has POSES poses: the BODY's positions relative to the point of the ground below the hips in the
    middle of the window, turned so that this pose faces +Z. Heading and place do not count, speed does.
    """
    body = positions[:, joints_with(skeleton, BODY)] / skeleton.leg_length
    rows = []
    for first in range(0, len(positions) - WINDOW + 1, STRIDE):
        poses = body[np.linspace(first, first + WINDOW - 1, POSES).round().astype(int)]
        middle = slice(first + WINDOW // 2, first + WINDOW // 2 + 1)
        ahead = facing_directions(skeleton, positions[middle], 0.0)[0]
        turn = quat.yaw(-np.arctan2(ahead[0], ahead[2]))
        origin = poses[POSES // 2, 0] * [1.0, 0.0, 1.0]
        rows.append(quat.rotate(turn, poses - origin).reshape(-1))
    return np.array(rows).reshape(len(rows), POSES * len(BODY) * 3)


def frechet_distance(a: Array, b: Array) -> float:
    """Frechet distance of two normal distributions fitted to a (N, C) and b (M, C) (Dowson, Landau 1982).

    |mean a - mean b|^2 + trace(A + B - 2 (A B)^(1/2)), where A and B are the covariances. In windows of
    `compare_windows`, 1 is the variance of the reference.
    """
    cov_a, cov_b = (np.cov(x, rowvar=False, bias=True) for x in (a, b))
    # The trace of (A B)^(1/2) is the sum of the square roots of the eigenvalues of A B.
    roots = np.sqrt(np.maximum(np.linalg.eigvals(cov_a @ cov_b).real, 0.0))
    between = np.sum((a.mean(axis=0) - b.mean(axis=0)) ** 2)
    return float(max(0.0, between + np.trace(cov_a) + np.trace(cov_b) - 2 * roots.sum()))


def diversity(windows: Array, pairs: int = 5000) -> float:
    """Mean distance of two windows (N, C) drawn at random with a fixed seed; 0 for one window."""
    first, second = np.random.default_rng(0).integers(0, len(windows), (2, pairs))
    return float(np.linalg.norm(windows[first] - windows[second], axis=1).mean())


def cleanness(skeleton: Skeleton, positions: Array, rotations: Array) -> dict[str, float]:
    """How clean a motion is: skating (of all points of the feet, of heels, of toes), joint_update, jerk and
    contact_speed.

    positions: (F, J, 3) cm, in the world. rotations: (F, J, 4) quaternions relative to the parent.
    """
    body, feet = joints_with(skeleton, BODY), positions[:, joints_with(skeleton, FOOT_POINTS)].astype(float)
    standing = standing_heights(feet)
    slid = skating(feet, standing)
    return {
        "skating": float(slid.mean()),
        "skating_heels": float(slid[:, ::2].mean()),
        "skating_toes": float(slid[:, 1::2].mean()),
        "joint_update": joint_update(rotations[:, body]),
        "jerk": jerk(positions[:, body].astype(float)),
        "contact_speed": contact_speed(feet, standing),
    }


def compare_windows(
    features: Array, reference: Array, first_half: np.ndarray
) -> tuple[dict[str, float], dict[str, float]]:
    """Frechet distance to a reference and diversity, of windows and of the reference itself.

    features, reference: (N, D) and (M, D) from `window_features`. first_half: (M,) which windows are one half
    of the reference. Its own Frechet distance is that of its halves; nan if one has fewer than two windows.
    """
    middle = reference.mean(axis=0)
    _, sizes, axes = np.linalg.svd(reference - middle, full_matrices=False)
    scale = np.sqrt(np.sum(sizes**2) / len(reference))  # of the windows' total variance
    windows, theirs = ((rows - middle) @ axes[:COMPONENTS].T / scale for rows in (features, reference))
    halves = theirs[first_half], theirs[~first_half]
    between = frechet_distance(*halves) if min(map(len, halves)) > 1 else float("nan")
    return (
        {"frechet": frechet_distance(windows, theirs), "diversity": diversity(windows)},
        {"frechet": between, "diversity": diversity(theirs)},
    )
