"""A long test for implausible poses: many characters with random targets on random grounds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypedDict

import numpy as np

from hobble.channels import channel
from hobble.core.quat import Array
from hobble.evaluation.motion_measures import SHORTEST_STANCE, STANCE
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.options import Runtime

FPS = 60
GAITS = ("walk", "jog", "crouch")
FASTEST_TARGET = 8.0  # cm a frame
START_SPACING_CM = 4e4  # between the starts of the characters, each on its own ground
# For the names see `soak`. No character may go beyond these limits in any frame.
LIMITS = {"hips_lowest_cm": 60.0, "hips_highest_cm": 110.0, "added_turn_degrees": 30.0}


@dataclass
class Targets:
    """The targets of C characters in a frame. Each character gets new ones every 1 to 8 seconds.

    velocity: (C, 2) cm a frame. facing: (C, 2) direction; (0, 0) for none. gait: C names. channels: name ->
    (C, columns). frames_left: (C,) frames until the next targets.
    """

    velocity: Array
    facing: Array
    gait: list[str]
    channels: dict[str, Array]
    frames_left: np.ndarray

    @classmethod
    def none(cls, characters: int, channels: Mapping[str, int]) -> Targets:
        """No targets yet. The first `renew` draws them for all characters."""
        return cls(
            np.zeros((characters, 2)),
            np.zeros((characters, 2)),
            [GAITS[0]] * characters,
            {name: np.zeros((characters, columns)) for name, columns in channels.items()},
            np.zeros(characters, int),
        )

    def renew(self, rng: np.random.Generator) -> None:
        """Draw new targets for the characters whose targets have run out.

        On average, a third of these characters stand still, and half of them face a random direction.
        """
        self.frames_left -= 1
        for c in np.flatnonzero(self.frames_left <= 0):
            going, looking = rng.uniform(-np.pi, np.pi, 2)
            speed = 0.0 if rng.random() < 1 / 3 else rng.uniform(0.2, FASTEST_TARGET)
            self.velocity[c] = speed * np.array([np.sin(going), np.cos(going)])
            self.facing[c] = rng.integers(2) * np.array([np.sin(looking), np.cos(looking)])
            self.gait[c] = GAITS[rng.integers(len(GAITS))]
            for name, values in self.channels.items():
                some = rng.random(values.shape[1]) < 2 / values.shape[1]
                values[c] = some * rng.uniform(0, channel(name).highest, values.shape[1])
            self.frames_left[c] = rng.integers(FPS, 8 * FPS)


def grounds(characters: int, rng: np.random.Generator) -> Callable[[Array, Array], Array]:
    """A function (x, z) -> height with a different ground around each character's start.

    The starts are START_SPACING_CM apart along x. On average a quarter of the grounds are flat; the others
    have hills 2 to 8 m long with slopes of up to 0.35 along x and along z.
    """
    length = rng.uniform(200, 800, characters)
    height = rng.uniform(0.05, 0.35, characters) * length / np.pi * (rng.random(characters) > 0.25)
    wave_number = 2 * np.pi / length

    def heights(x: Array, z: Array) -> Array:
        k = np.clip(np.rint(x / START_SPACING_CM), 0, characters - 1).astype(int)
        return np.asarray(0.5 * height[k] * (np.sin(wave_number[k] * x) + np.sin(wave_number[k] * z)))

    return heights


@dataclass
class StanceSlides:
    """Adds up, frame by frame, how far the toes of C characters slide in each stance.

    far: (C, 2) distance in the present stance, cm. frames: (C, 2) frames of this stance so far. done: for
    each frame, the distances of the stances that ended in it, cm.
    """

    far: Array
    frames: np.ndarray
    done: list[Array] = field(default_factory=list)

    def add(self, toes: Array, before: Array, standing: np.ndarray) -> None:
        """Add a frame. toes, before: (C, 2, 3) positions now and in the frame before. standing: (C, 2)."""
        over = ~standing & (self.frames >= SHORTEST_STANCE)
        self.done.append(self.far[over])
        stays = standing & (self.frames > 0)
        self.far = np.where(stays, self.far + np.hypot(*(toes - before)[..., ::2].transpose(2, 0, 1)), 0.0)
        self.frames = np.where(standing, self.frames + 1, 0)


def turn_angles(now: Array, before: Array) -> Array:
    """(...) angle between the rotations `now` and `before` (..., 4), degrees."""
    dot = np.abs(np.sum(now * before, axis=-1))
    return np.asarray(np.degrees(2 * np.arccos(np.minimum(1.0, dot))))


@dataclass
class WorstPoses:
    """The worst values of all characters in the frames so far. Names as in `soak`, without the unit."""

    finite: bool = True
    hips_lowest: float = np.inf
    hips_highest: float = -np.inf
    network_turn: float = 0.0
    turn: float = 0.0
    added_turn: float = 0.0
    fastest_joint: float = 0.0
    frames_beyond: int = 0

    def add_heights(self, hips: Array) -> None:
        """Add the heights (C,) of the hips above the ground in a frame."""
        self.hips_lowest = min(self.hips_lowest, float(hips.min()))
        self.hips_highest = max(self.hips_highest, float(hips.max()))

    def add_movement(self, now: tuple[Array, ...], before: tuple[Array, ...]) -> None:
        """Add what changed from one frame to the next.

        now, before: positions (C, J, 3) and rotations (C, J, 4) as drawn, and rotations (C, J, 4) without the
        placement of the feet.
        """
        turn, unplaced = turn_angles(now[1], before[1]), turn_angles(now[2], before[2])
        added = turn - unplaced
        self.turn = max(self.turn, float(turn.max()))
        self.network_turn = max(self.network_turn, float(unplaced.max()))
        self.added_turn = max(self.added_turn, float(added.max()))
        self.fastest_joint = max(self.fastest_joint, float(np.linalg.norm(now[0] - before[0], axis=-1).max()))
        self.frames_beyond += int((added.max(axis=1) > LIMITS["added_turn_degrees"]).sum())

    @property
    def within_limits(self) -> bool:
        """Whether all values are finite and within LIMITS."""
        return (
            self.finite
            and self.hips_lowest >= LIMITS["hips_lowest_cm"]
            and self.hips_highest <= LIMITS["hips_highest_cm"]
            and self.added_turn <= LIMITS["added_turn_degrees"]
        )


class Soak(TypedDict):
    """The worst values over all characters and frames. See `soak`."""

    frames: int
    finite: bool
    hips_lowest_cm: float
    hips_highest_cm: float
    network_turn_degrees: float
    turn_degrees: float
    added_turn_degrees: float
    frames_beyond: int
    fastest_joint_cm: float
    slide_cm: float | None
    stances: int
    holds: bool


def soak(
    network: Network, characters: int = 200, frames: int = 5000, seed: int = 1, runtime: Runtime | None = None
) -> Soak:
    """The worst values over all characters and frames.

    `finite`: whether all numbers are finite. `hips_lowest_cm`, `hips_highest_cm`: height of the hips above
    the ground under them. `network_turn_degrees`: largest turn of a joint in one frame before the feet are
    placed; `turn_degrees`: the same as drawn, with the feet placed; `added_turn_degrees`: the most by which
    placing the feet makes a turn larger. `frames`: number of frames of all characters together;
    `frames_beyond`: number of those in which the added turn exceeds its limit. `fastest_joint_cm`: largest
    movement of a joint in one frame. `slide_cm`: mean slide of a toe in a stance. `stances`: number of
    stances. `holds`: whether all values are within LIMITS.
    """
    rng = np.random.default_rng(seed)
    skeleton = network.skeleton
    assert skeleton is not None
    starts = np.zeros((characters, 3))
    starts[:, 0] = START_SPACING_CM * np.arange(characters)
    animation = ProceduralAnimation(
        network, characters=characters, position=starts, **dict(runtime or Runtime())
    )
    ground, targets = grounds(characters, rng), Targets.none(characters, dict(network.layout.channels))
    hips = skeleton.role("hips")
    toes = [skeleton.role("left_toe"), skeleton.role("right_toe")]
    worst = WorstPoses()
    slides = StanceSlides(np.zeros((characters, 2)), np.zeros((characters, 2), int))
    old: tuple[Array, ...] | None = None
    for _ in range(frames):
        targets.renew(rng)
        pose = animation.next_pose(
            targets.velocity, targets.facing, targets.gait, terrain=ground, **targets.channels
        )
        worst.finite &= bool(np.isfinite(pose.positions).all() and np.isfinite(pose.rotations).all())
        at = pose.positions[:, hips]
        worst.add_heights(at[:, 1] - ground(at[:, 0], at[:, 2]))
        now = pose.positions, pose.rotations, animation.state.joint_rotation.copy()
        if old is not None:
            worst.add_movement(now, old)
            slides.add(now[0][:, toes], old[0][:, toes], pose.contacts[:, 1::2] >= STANCE)
        old = now
    slide = np.concatenate(slides.done)
    return {
        "frames": characters * frames,
        "finite": worst.finite,
        "hips_lowest_cm": round(worst.hips_lowest, 1),
        "hips_highest_cm": round(worst.hips_highest, 1),
        "network_turn_degrees": round(worst.network_turn, 1),
        "turn_degrees": round(worst.turn, 1),
        "added_turn_degrees": round(worst.added_turn, 1),
        "frames_beyond": worst.frames_beyond,
        "fastest_joint_cm": round(worst.fastest_joint, 1),
        "slide_cm": round(float(slide.mean()), 3) if len(slide) else None,
        "stances": len(slide),
        "holds": worst.within_limits,
    }
