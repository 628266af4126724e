"""What must hold in every clip, computed from positions and contacts alone."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.labels.clip_labels import CONTACT_ROLES, Labels

SIDES = ("left", "right")


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
