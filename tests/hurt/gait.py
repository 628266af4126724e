"""Measures of a walk, computed from positions and contacts alone."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.hurt.hurt_clip import HurtClip
from hobble.labels.clip_labels import CONTACT_ROLES, Labels
from hobble.labels.footfall import Swing, find_swings
from hobble.labels.options import LabelOptions as Options

SIDES = ("left", "right")


def measures(clip: Clip, labels: Labels) -> dict[str, float]:
    """Speed (cm/s), share of stance, step (cm), knee range, lean of the trunk (forward, left), arm swing;
    degrees.

    Sided ones end in _left and _right. A step is how far the landing ankle is ahead of the other.
    """
    role = {
        name: clip.positions[:, joint]
        for name, joint in ((r, clip.skeleton.role(r)) for r in clip.skeleton.roles)
    }
    inside = slice(60, len(clip) - 60)
    hips = role["hips"]
    out = {"speed": float(np.sum(np.linalg.norm(np.diff(_smooth(hips[:, [0, 2]]), axis=0), axis=1)[inside]))}
    out["speed"] *= 60 / (len(clip) - 120)
    landings = {"right": labels.footsteps[:, 0], "left": labels.footsteps[:, 1]}
    left = (role["left_hip"] - role["right_hip"]) * [1, 0, 1]
    left = left / np.linalg.norm(left, axis=1, keepdims=True)
    ahead = np.cross(left, [0.0, 1.0, 0.0])
    trunk = role["neck"] - hips
    # By the motion alone: contacts are those that the generator knows.
    up = _feet_up(find_swings(clip, Options()), len(clip))
    out["forward"] = _degrees(np.sum(trunk * ahead, axis=1), trunk[:, 1])[inside].mean()
    out["left"] = _degrees(np.sum(trunk * left, axis=1), trunk[:, 1])[inside].mean()
    for i, side in enumerate(SIDES):
        own, other = role[f"{side}_heel"], role[f"{SIDES[1 - i]}_heel"]
        out[f"stance_{side}"] = float(1 - up[inside, 1 - i].mean())
        at = [round(x) for x in landings[side] if np.isfinite(x) and 60 <= x < len(clip) - 60]
        out[f"step_{side}"] = float(np.mean([np.sum((own[f] - other[f]) * ahead[f]) for f in at]))
        bend = knee(clip, side)[inside]
        out[f"knee_{side}"] = float(np.ptp(np.percentile(bend, [3, 97])))
        arm = role[f"{side}_wrist"] - role[f"{side}_shoulder"]
        swing = _degrees(np.sum(arm * ahead, axis=1), -arm[:, 1])[inside]
        out[f"arm_{side}"] = float(np.ptp(np.percentile(swing, [5, 95])))
    return out


def _smooth(values: np.ndarray) -> np.ndarray:
    kernel = np.ones(21) / 21
    return np.stack([np.convolve(np.pad(c, 10, mode="edge"), kernel, "valid") for c in values.T], axis=1)


def _degrees(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(np.arctan2(a, b))


def knee(clip: Clip, side: str) -> np.ndarray:
    """(F,) knee flexion in degrees; negative if the knee is bent backwards."""
    hip, joint, ankle = (
        clip.positions[:, clip.skeleton.role(f"{side}_{r}")] for r in ("hip", "knee", "heel")
    )
    thigh, shank = joint - hip, ankle - joint
    angle = np.degrees(np.arccos(np.clip(_cosine(thigh, shank), -1, 1)))
    leg = ankle - hip
    out = thigh - leg * np.sum(thigh * leg, axis=1, keepdims=True) / np.sum(leg * leg, axis=1, keepdims=True)
    pelvis = clip.skeleton.role("hips")
    across = (
        clip.positions[:, clip.skeleton.role("left_hip")] - clip.positions[:, clip.skeleton.role("right_hip")]
    )
    ahead = np.cross(across, quat.rotate(clip.global_rotations[:, pelvis], np.array([0.0, 1.0, 0.0])))
    return np.where(np.sum(out * ahead, axis=1) < 0, -angle, angle)


def _cosine(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.sum(a * b, axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)


def slide(clip: Clip, labels: Labels) -> float:
    """cm a frame that the joints in contact move over the ground, on average."""
    feet = clip.positions[:, [clip.skeleton.role(role) for role in CONTACT_ROLES]]
    moved = np.linalg.norm(np.diff(feet[..., [0, 2]], axis=0), axis=2)
    both = labels.contacts[:-1] & labels.contacts[1:]
    return float(moved[both].mean()) if both.sum() > 20 else 0.0


def toe_heights(clip: Clip, labels: Labels) -> np.ndarray:
    """Heights of the toe joints that are in contact."""
    toes = clip.positions[:, [clip.skeleton.role(f"{side}_toe") for side in SIDES], 1]
    return np.asarray(toes[labels.contacts[:, [1, 3]]])


def fastest(clip: Clip) -> float:
    """Degrees a second of the fastest turning joint."""
    return float(np.degrees(quat.angle(clip.rotations[:-1], clip.rotations[1:]).max()) * clip.fps)


def effects(healthy: dict[str, float], hurt: HurtClip, side: str) -> dict[str, float]:
    """Sizes relative to the healthy walk, as in the table of goals, if `side` is hurt."""
    other = SIDES[1 - SIDES.index(side)]
    seen = measures(hurt.clip, hurt.labels)
    return {
        "speed": seen["speed"] / healthy["speed"],
        "stance": (seen[f"stance_{other}"] - seen[f"stance_{side}"])
        - (healthy[f"stance_{other}"] - healthy[f"stance_{side}"]),
        "step": seen[f"step_{side}"] / healthy[f"step_{side}"],
        "knee": seen[f"knee_{side}"] / healthy[f"knee_{side}"],
        "lean": float(np.hypot(seen["forward"] - healthy["forward"], seen["left"] - healthy["left"])),
        "arm": seen[f"arm_{side}"] / healthy[f"arm_{side}"],
    }


def _feet_up(swings: list[Swing], frames: int) -> np.ndarray:
    """(frames, 2) bool: whether the right and the left foot are in a swing."""
    up = np.zeros((frames, 2), bool)
    for swing in swings:
        up[swing.start : swing.end, swing.foot] = True
    return up
