"""Measures of generated motion: foot slide, turns, steps, angles. Centimetres, degrees, 60 frames a second.

F is the number of frames, J that of joints. contacts: (F, 4) predicted contacts with the ground, from 0 to 1,
of left heel, left toe, right heel, right toe.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton

STANCE = 0.5  # a foot counts as standing if its predicted contact is at least this
SHORTEST_STANCE = 4  # frames; a shorter contact is neither a stance nor a step
# A toe skates if it moves less than this many cm above the height of a standing toe (Zhang et al. 2018).
SKATING_BELOW = 2.5


def runs_of_true(on: np.ndarray) -> np.ndarray:
    """(N, 2) for each run of true values in `on` (F,): its first frame, and the first frame after it.

    >>> runs_of_true(np.array([False, True, True, False, True])).tolist()
    [[1, 3], [4, 5]]
    """
    edges = np.diff(np.concatenate([[0], np.asarray(on, np.int8), [0]]))
    return np.flatnonzero(edges).reshape(-1, 2)


def feet_in_stance(contacts: Array) -> np.ndarray:
    """(F, 2) whether the left and the right foot stand, on heel or toe or both. contacts: (F, 4)."""
    return np.maximum(contacts[:, ::2], contacts[:, 1::2]) >= STANCE


def foot_slide(toes: Array, contacts: Array) -> Array:
    """(N,) how far the toe slides over the ground in each of N stances, cm.

    The stances of the left foot come first. A stance is a run of at least SHORTEST_STANCE frames in which the
    toe has contact. toes: (F, 2, 3) positions of the left and right toe, cm. contacts: (F, 4).
    """
    out = []
    for side in range(2):
        moved = np.linalg.norm(np.diff(toes[:, side, ::2], axis=0), axis=1)
        for start, end in runs_of_true(contacts[:, 2 * side + 1] >= STANCE):
            if end - start >= SHORTEST_STANCE:
                out.append(moved[start : end - 1].sum())
    return np.array(out)


def skating(toes: Array, standing_height: float) -> Array:
    """(F - 1, 2) how far each toe skates over the ground from one frame to the next, cm.

    Predicted contacts are not used. After Zhang, Starke, Komura, Saito (2018), a horizontal movement v counts
    as v (2 - 2^(h / SKATING_BELOW)): all of it on the ground, none of it at SKATING_BELOW. h is the toe's
    height above `standing_height`, clipped to 0 .. SKATING_BELOW. Of the heights before and after the
    movement, the larger is taken. toes: (F, 2, 3) positions of the left and right toe, cm, heights above the
    ground. standing_height: height of the toe joint of a standing foot, cm.
    """
    moved = np.linalg.norm(np.diff(toes[..., ::2], axis=0), axis=-1)
    height = np.maximum(toes[1:, :, 1], toes[:-1, :, 1]) - standing_height
    return np.asarray(moved * (2.0 - 2.0 ** (np.clip(height, 0.0, SKATING_BELOW) / SKATING_BELOW)))


def largest_turn(rotations: Array) -> float:
    """Largest rotation of any joint from one frame to the next, degrees.

    rotations: (F, J, 4) quaternions of the joints in the world.
    """
    return float(turns_between(rotations).max(initial=0.0))


def turns_between(rotations: Array) -> Array:
    """(F - 1, ...) largest rotation of any joint since the frame before, degrees.

    rotations: (F, ..., J, 4) quaternions of the joints in the world.
    """
    # Two rotations whose quaternions have the dot product d differ by an angle of 2 arccos |d|.
    dot = np.abs(np.sum(rotations[1:] * rotations[:-1], axis=-1, dtype=float))
    return np.asarray(np.degrees(2 * np.arccos(np.minimum(1.0, dot.min(axis=-1)))))


def acceleration(positions: Array) -> Array:
    """(F - 2, ...) length of the second difference of positions (F, ..., 3), cm per frame squared."""
    return np.linalg.norm(np.diff(positions, n=2, axis=0), axis=-1)


def bend(a: Array, b: Array, c: Array) -> Array:
    """(...) degrees by which a limb is bent at b; 0 is straight.

    a, b, c: (..., 3) positions of three successive joints of the limb.
    """
    u, v = b - a, c - b
    cosine = np.sum(u * v, axis=-1) / np.maximum(
        np.linalg.norm(u, axis=-1) * np.linalg.norm(v, axis=-1), 1e-9
    )
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def in_root_coordinates(positions: Array, root: Array, yaw: Array) -> Array:
    """Convert world positions (..., J, 3) to coordinates of a root at `root` (..., 3) with `yaw` (...)."""
    p = positions - root[..., None, :]
    sin, cos = np.sin(yaw)[..., None], np.cos(yaw)[..., None]
    x, z = p[..., 0] * cos - p[..., 2] * sin, p[..., 0] * sin + p[..., 2] * cos
    return np.stack([x, p[..., 1], z], axis=-1)


def asymmetry(left: float | None, right: float | None) -> float | None:
    """(left - right) / mean of both: positive if the left is larger. None if one is None or both are 0."""
    if left is None or right is None or left + right == 0:
        return None
    return 2 * (left - right) / (left + right)


def gait_measures(
    skeleton: Skeleton, local: Array, contacts: Array, travelled: Array
) -> dict[str, float | None]:
    """Measures of one character's walk: name -> value.

    local: (F, J, 3) joint positions in root coordinates, cm. contacts: (F, 4). travelled: (F, 3) positions of
    the root in the world, cm.

    `speed`: cm/s, from the straight distance between the first and last root. `stance_left`: share of the
    frames in which the foot stands. `step_left`: mean step length, cm, that is how far the landing heel is
    ahead of the other heel; None if there is no step. `knee_left`, `arm_left`: range of the knee's bend and
    of the arm's swing, degrees from the 5th to the 95th percentile. The right side has the same measures.
    `stance_asymmetry`, `step_asymmetry`: see `asymmetry`. `lean_forward`, `lean_left`: mean lean of the
    trunk, degrees. `hip_height`: mean height of the hips, cm.
    """
    role = skeleton.role
    seconds = (len(local) - 1) / 60
    standing = feet_in_stance(contacts)
    heels = local[:, [role("left_heel"), role("right_heel")], 2]  # how far forward
    steps: list[list[float]] = [[], []]  # lengths of the left foot's steps, then of the right foot's
    for side in range(2):
        for start, end in runs_of_true(standing[:, side]):
            if start > 0 and end - start >= SHORTEST_STANCE:  # a stance from frame 0 has no landing
                steps[side].append(heels[start, side] - heels[start, 1 - side])
    step_lengths = [float(np.mean(lengths)) if lengths else None for lengths in steps]
    stance_shares = [float(share) for share in standing.mean(axis=0)]
    out: dict[str, Any] = {
        "speed": float(np.linalg.norm((travelled[-1] - travelled[0])[::2]) / seconds),
        "stance_left": stance_shares[0],
        "stance_right": stance_shares[1],
        "stance_asymmetry": asymmetry(*stance_shares),
        "step_left": step_lengths[0],
        "step_right": step_lengths[1],
        "step_asymmetry": asymmetry(*step_lengths),
    }
    for name in ("left", "right"):
        hip, knee, heel = (local[:, role(f"{name}_{part}")] for part in ("hip", "knee", "heel"))
        arm = local[:, role(f"{name}_wrist")] - local[:, role(f"{name}_shoulder")]
        out[f"knee_{name}"] = _percentile_range(bend(hip, knee, heel))
        out[f"arm_{name}"] = _percentile_range(np.degrees(np.arctan2(arm[:, 2], -arm[:, 1])))
    trunk = (local[:, role("neck")] - local[:, role("hips")]).mean(axis=0)
    out["lean_forward"] = float(np.degrees(np.arctan2(trunk[2], trunk[1])))
    out["lean_left"] = float(np.degrees(np.arctan2(trunk[0], trunk[1])))
    out["hip_height"] = float(local[:, role("hips"), 1].mean())
    return out


def _percentile_range(angles: Array) -> float:
    """Difference between the 95th and the 5th percentile."""
    low, high = np.percentile(angles, [5, 95])
    return float(high - low)
