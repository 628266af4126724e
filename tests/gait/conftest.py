"""Walkers made joint by joint, so that their measures are known exactly."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hobble.cli.gait import read_clip
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, two_bone_knee

CYCLE = 60  # frames
FRAMES = 6 * CYCLE + 1
THIGH, SHANK = 41.0, 40.0
LEG = THIGH + SHANK
FOOT = np.array([0.0, -4.0, 13.0])
SIDES = {"left": 1.0, "right": -1.0}  # +X is the left


def place(skeleton: Skeleton, at: Mapping[str, Array]) -> Array:
    """(F, J, 3) with the joints of these roles at these places, and all others at the hips."""
    joints = {skeleton.role(role): points for role, points in at.items()}
    return np.stack([joints.get(i, at["hips"]) for i in range(len(skeleton.joints))], axis=1)


def body(speed: float) -> dict[str, Array]:
    """An upright figure that moves ahead at `speed` cm a frame with hanging arms, without knees."""

    def up(height: float, left: float = 0.0) -> Array:
        return np.array([left, height, 0.0])

    frame = np.arange(FRAMES)
    hips = np.stack([0.0 * frame, 0 * frame + 72.0, speed * frame], axis=1)
    at = {"hips": hips, "spine": hips, "chest": hips + up(40), "neck": hips + up(50), "head": hips + up(60)}
    for side, sign in SIDES.items():
        at[f"{side}_hip"], at[f"{side}_shoulder"] = hips + up(0, 9 * sign), hips + up(45, 18 * sign)
        at[f"{side}_elbow"] = at[f"{side}_shoulder"] - up(29)
        at[f"{side}_wrist"] = at[f"{side}_elbow"] - up(23)
    return at


def swing(middle_and_half: tuple[float, float], wave: Array) -> Array:
    return middle_and_half[0] + middle_and_half[1] * wave


def down(degrees: Array) -> Array:
    """Unit vectors (F, 3) that hang down and point forward by an angle."""
    angle = np.radians(degrees)
    return np.stack([0 * angle, -np.cos(angle), np.sin(angle)], axis=1)


@dataclass(frozen=True)
class Stepper:
    """A walker whose feet stand, in frames of a cycle of CYCLE, and land `ahead` of the hips, cm.

    right_lands, left_lands: frame of the cycle. The feet stand still in stance and swing at one speed.
    """

    stance_right: int = 36
    stance_left: int = 36
    ahead_right: float = 25.0
    ahead_left: float = 25.0
    left_lands: int = 30
    speed: float = 1.5
    width: float = 18.0

    def positions(self, skeleton: Skeleton) -> Array:
        """(F, J, 3); the right foot lands at frame 0, CYCLE, 2 CYCLE and so on."""
        at, frames = body(self.speed), np.arange(FRAMES)
        for side, sign in SIDES.items():
            ahead = self.relative(side, frames)
            ankle = at["hips"] * [1, 0, 1] + np.stack([0 * ahead, 0 * ahead + 8, ahead], axis=1)
            ankle[:, 0] += sign * self.width / 2
            hip = at[f"{side}_hip"]
            at[f"{side}_knee"], reached = two_bone_knee(hip, ankle, np.array([0.0, 0, 1]), THIGH, SHANK)
            assert np.allclose(reached, ankle)
            at[f"{side}_heel"] = ankle
            at[f"{side}_toe"] = ankle + FOOT
        return place(skeleton, at)

    def relative(self, side: str, frame: Array) -> Array:
        """How far the ankle is ahead of the hips, cm."""
        stance, ahead = getattr(self, f"stance_{side}"), getattr(self, f"ahead_{side}")
        lands = 0 if side == "right" else self.left_lands
        since = (frame - lands) % CYCLE
        swung = np.maximum(since - stance, 0) / (CYCLE - stance) * self.speed * CYCLE
        return ahead - self.speed * since + swung


@dataclass(frozen=True)
class Swinger:
    """A figure whose joints swing by known angles, degrees; each is (middle, half of the range).

    The right leg is furthest ahead at frame 0 of each cycle, the left one half a cycle later.
    """

    hip: Mapping[str, tuple[float, float]]
    knee: Mapping[str, float]
    arm: Mapping[str, tuple[float, float]]
    elbow: float = 20.0
    trunk_forward: tuple[float, float] = (5.0, 2.0)
    trunk_left: tuple[float, float] = (3.0, 4.0)
    pelvis_left_up: float = 6.0

    def positions(self, skeleton: Skeleton) -> Array:
        """(F, J, 3)."""
        at, wave = body(1.2), np.cos(2 * np.pi * np.arange(FRAMES) / CYCLE)
        up = np.radians(self.pelvis_left_up)
        for side, sign in SIDES.items():
            beat = wave * -sign
            at[f"{side}_hip"] = at["hips"] + sign * 9 * np.array([np.cos(up), np.sin(up), 0])
            hip, knee = swing(self.hip[side], beat), self.knee[side] * (1 - beat) / 2
            at[f"{side}_knee"] = at[f"{side}_hip"] + THIGH * down(hip)
            at[f"{side}_heel"] = at[f"{side}_knee"] + SHANK * down(hip - knee)
            at[f"{side}_toe"] = at[f"{side}_heel"] + FOOT
            arm = swing(self.arm[side], beat)
            at[f"{side}_elbow"] = at[f"{side}_shoulder"] + 29 * down(arm)
            at[f"{side}_wrist"] = at[f"{side}_elbow"] + 23 * down(arm + self.elbow)
        leans = self.trunk_forward, self.trunk_left
        forward, left = (np.tan(np.radians(swing(lean, wave))) for lean in leans)
        at["neck"] = at["hips"] + 50 * np.stack([left, np.ones(FRAMES), forward], axis=1)
        return place(skeleton, at)


@pytest.fixture(scope="session")
def cmu(shared: Path) -> Callable[[str], Clip]:
    """A clip of the CMU database or of Ferre et al. by name, read once."""

    @cache
    def get(name: str) -> Clip:
        folder = "ferre" if name.startswith("Injured") else "cmu"
        return read_clip(shared / "mocap" / folder / f"{name}.bvh")

    return get
