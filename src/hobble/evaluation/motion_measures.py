"""Measures of generated motion: foot slide, turns, steps, angles. Centimetres, degrees, 60 frames a second.

F is the number of frames. The columns of contacts (F, 4) are left heel, left toe, right heel, right toe.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton

STANCE = 0.5  # a foot counts as standing if its predicted contact is at least this
SHORTEST_STANCE = 4  # frames; shorter contacts count as no stance and no step
SKATING_BELOW = 2.5  # cm above its standing height; a toe that moves below this skates (Zhang et al. 2018)


def runs(on: np.ndarray) -> np.ndarray:
    """(N, 2) first frame and end (exclusive) of each run of true values in `on` (F,).

    >>> runs(np.array([False, True, True, False, True])).tolist()
    [[1, 3], [4, 5]]
    """
    edges = np.diff(np.concatenate([[0], np.asarray(on, np.int8), [0]]))
    return np.flatnonzero(edges).reshape(-1, 2)


def stance(contacts: Array) -> np.ndarray:
    """(F, 2) whether the left and the right foot stand, on heel or toe. contacts: (F, 4)."""
    return np.maximum(contacts[:, ::2], contacts[:, 1::2]) >= STANCE


def foot_slide(toes: Array, contacts: Array) -> Array:
    """(N,) how far the toe slides in each of N stances, cm. Those of the left foot come first.

    toes: (F, 2, 3) left and right, cm.
    """
    out = []
    for side in range(2):
        step = np.linalg.norm(np.diff(toes[:, side, ::2], axis=0), axis=1)
        for a, b in runs(contacts[:, 2 * side + 1] >= STANCE):
            if b - a >= SHORTEST_STANCE:
                out.append(step[a : b - 1].sum())
    return np.array(out)


def skating(toes: Array, standing_height: float) -> Array:
    """(F - 1, 2) how far each toe skates over the ground in a frame, cm. Contacts do not matter.

    After Zhang, Starke, Komura, Saito (2018): a horizontal movement v counts as
    v (2 - 2^(h / SKATING_BELOW)). h is the height of the toe above `standing_height`, before or after the
    movement, whichever is larger, clipped to 0 .. SKATING_BELOW. toes: (F, 2, 3) left and right, heights
    above the ground. standing_height: height of the toe joint of a standing foot, cm.
    """
    moved = np.linalg.norm(np.diff(toes[..., ::2], axis=0), axis=-1)
    height = np.maximum(toes[1:, :, 1], toes[:-1, :, 1]) - standing_height
    return np.asarray(moved * (2.0 - 2.0 ** (np.clip(height, 0.0, SKATING_BELOW) / SKATING_BELOW)))


def largest_turn(rotations: Array) -> float:
    """Largest turn of any joint from one frame to the next, degrees. rotations: (F, J, 4) in the world."""
    return float(turns_between(rotations).max(initial=0.0))


def turns_between(rotations: Array) -> Array:
    """(F - 1, ...) largest turn of any joint since the frame before, degrees. rotations: (F, ..., J, 4)."""
    dot = np.abs(np.sum(rotations[1:] * rotations[:-1], axis=-1, dtype=float))
    return np.asarray(np.degrees(2 * np.arccos(np.minimum(1.0, dot.min(axis=-1)))))


def acceleration(positions: Array) -> Array:
    """(F - 2, ...) length of the second difference of positions (F, ..., 3), cm per frame squared."""
    return np.linalg.norm(np.diff(positions, n=2, axis=0), axis=-1)


def bend(a: Array, b: Array, c: Array) -> Array:
    """(...) degrees by which the joint at b is bent; 0 is straight. a, b, c: (..., 3) along the limb."""
    u, v = b - a, c - b
    cosine = np.sum(u * v, axis=-1) / np.maximum(
        np.linalg.norm(u, axis=-1) * np.linalg.norm(v, axis=-1), 1e-9
    )
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def in_root_coordinates(positions: Array, root: Array, yaw: Array) -> Array:
    """World positions (..., J, 3) in the coordinates of a root at `root` (..., 3) with `yaw` (...)."""
    p = positions - root[..., None, :]
    sin, cos = np.sin(yaw)[..., None], np.cos(yaw)[..., None]
    x, z = p[..., 0] * cos - p[..., 2] * sin, p[..., 0] * sin + p[..., 2] * cos
    return np.stack([x, p[..., 1], z], axis=-1)


def asymmetry(left: float | None, right: float | None) -> float | None:
    """(left - right) / mean: 0 if equal, positive if the left is larger. None if one is missing or both 0."""
    if left is None or right is None or left + right == 0:
        return None
    return 2 * (left - right) / (left + right)


def gait_measures(
    skeleton: Skeleton, local: Array, contacts: Array, travelled: Array
) -> dict[str, float | None]:
    """Measures of one character's walk.

    local: (F, J, 3) joint positions in root coordinates, cm. contacts: (F, 4). travelled: (F, 3) positions of
    the root in the world, cm. Returns speed (cm/s, from the straight distance between first and last root),
    stance shares (of the frames), step lengths (how far the landing heel is ahead of the other heel, cm),
    knee and arm ranges (degrees from the 5th to the 95th percentile), trunk lean (degrees, forward and to the
    left), hip height (cm) and asymmetries (`asymmetry`). Step lengths are None if there is no step.
    """
    role = skeleton.role
    seconds = (len(local) - 1) / 60
    standing = stance(contacts)
    heels = local[:, [role("left_heel"), role("right_heel")], 2]
    steps: list[list[float]] = [[], []]
    for side in range(2):
        for a, b in runs(standing[:, side]):
            if a > 0 and b - a >= SHORTEST_STANCE:
                steps[side].append(heels[a, side] - heels[a, 1 - side])
    length = [float(np.mean(s)) if s else None for s in steps]
    share = [float(s) for s in standing.mean(axis=0)]
    out: dict[str, Any] = {
        "speed": float(np.linalg.norm((travelled[-1] - travelled[0])[::2]) / seconds),
        "stance_left": share[0],
        "stance_right": share[1],
        "stance_asymmetry": asymmetry(*share),
        "step_left": length[0],
        "step_right": length[1],
        "step_asymmetry": asymmetry(*length),
    }
    for name in ("left", "right"):
        hip, knee, heel = (local[:, role(f"{name}_{part}")] for part in ("hip", "knee", "heel"))
        arm = local[:, role(f"{name}_wrist")] - local[:, role(f"{name}_shoulder")]
        out[f"knee_{name}"] = _range(bend(hip, knee, heel))
        out[f"arm_{name}"] = _range(np.degrees(np.arctan2(arm[:, 2], -arm[:, 1])))
    trunk = (local[:, role("neck")] - local[:, role("hips")]).mean(axis=0)
    out["lean_forward"] = float(np.degrees(np.arctan2(trunk[2], trunk[1])))
    out["lean_left"] = float(np.degrees(np.arctan2(trunk[0], trunk[1])))
    out["hip_height"] = float(local[:, role("hips"), 1].mean())
    return out


def _range(angles: Array) -> float:
    low, high = np.percentile(angles, [5, 95])
    return float(high - low)
