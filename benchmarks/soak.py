"""A million frames with random targets, injuries and grounds, by many characters at once.

    python benchmarks/soak.py results/injured/network [--characters 200] [--frames 5000] [--seed 1]

Prints the worst values, and exits with status 1 if one exceeds `LIMITS`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypedDict

import numpy as np

from hobble.channels import channel
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.measures.walks import SHORTEST_STANCE, STANCE
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime import Runtime
from hobble.runtime.animation import ProceduralAnimation

FPS = 60
GAITS = ("walk", "jog", "crouch")
FASTEST_TARGET = 8.0  # cm a frame
START_SPACING_CM = 4e4  # distance between the starts of neighbouring characters, each on its own ground
# No character may go beyond these limits in any frame. `soak` explains the names.
LIMITS = {"hips_lowest_cm": 60.0, "hips_highest_cm": 110.0, "added_turn_degrees": 30.0}


@dataclass
class Targets:
    """The targets of C characters in a frame. Each character gets new targets every 1 to 8 seconds.

    velocity: (C, 2) cm a frame. facing: (C, 2) direction; (0, 0) stands for no target of the facing. gait: C
    names of GAITS. channels: name of a channel -> its target values (C, columns of the channel). frames_left:
    (C,) frames until the next targets.
    """

    velocity: Array
    facing: Array
    gait: list[str]
    channels: dict[str, Array]
    frames_left: np.ndarray

    @classmethod
    def undrawn(cls, characters: int, channels: Mapping[str, int]) -> Targets:
        """All targets 0. The first call of `renew` draws targets for all characters.

        channels: name of a channel -> number of its columns.
        """
        return cls(
            np.zeros((characters, 2)),
            np.zeros((characters, 2)),
            [GAITS[0]] * characters,
            {name: np.zeros((characters, columns)) for name, columns in channels.items()},
            np.zeros(characters, int),
        )

    def renew(self, rng: np.random.Generator) -> None:
        """Go on by a frame, and draw new targets for the characters whose time with the old ones is over.

        On average, a third of these characters stand still, half of them face a random direction, and two
        columns of each channel are not 0.
        """
        self.frames_left -= 1
        for c in np.flatnonzero(self.frames_left <= 0):
            going, looking = rng.uniform(-np.pi, np.pi, 2)
            speed = 0.0 if rng.random() < 1 / 3 else rng.uniform(0.2, FASTEST_TARGET)
            self.velocity[c] = speed * np.array([np.sin(going), np.cos(going)])
            self.facing[c] = rng.integers(2) * np.array([np.sin(looking), np.cos(looking)])
            self.gait[c] = GAITS[rng.integers(len(GAITS))]
            for name, values in self.channels.items():
                is_set = rng.random(values.shape[1]) < 2 / values.shape[1]
                values[c] = is_set * rng.uniform(0, channel(name).highest, values.shape[1])
            self.frames_left[c] = rng.integers(FPS, 8 * FPS)


def varied_ground(characters: int, rng: np.random.Generator) -> Callable[[Array, Array], Array]:
    """A function (x, z) -> height, all in cm, with a different ground around each character's start.

    The starts are START_SPACING_CM apart along x. On average a quarter of the grounds are flat. The others
    have hills 2 to 8 m long with slopes of up to 0.35 along x and along z.
    """
    length = rng.uniform(200, 800, characters)
    # A sine wave of this height (crest above trough) and length has the largest slope 0.05 to 0.35.
    height = rng.uniform(0.05, 0.35, characters) * length / np.pi * (rng.random(characters) > 0.25)
    wave_number = 2 * np.pi / length

    def heights(x: Array, z: Array) -> Array:
        nearest = np.clip(np.rint(x / START_SPACING_CM), 0, characters - 1).astype(int)
        wave = np.sin(wave_number[nearest] * x) + np.sin(wave_number[nearest] * z)
        return np.asarray(0.5 * height[nearest] * wave)

    return heights


@dataclass
class StanceSlides:
    """Adds up, frame by frame, how far the toes of C characters slide in each stance.

    slid: (C, 2) how far the left and right toe have slid in the present stance, cm. frames: (C, 2) how many
    frames this stance has lasted. ended_slides: for each frame, an array with the slides of the stances that
    ended in it, cm.
    """

    slid: Array
    frames: np.ndarray
    ended_slides: list[Array] = field(default_factory=list)

    def add(self, toes: Array, before: Array, standing: np.ndarray) -> None:
        """Add a frame.

        toes, before: (C, 2, 3) positions of the toes in this frame and in the frame before, cm. standing:
        (C, 2) whether each toe is in a stance.
        """
        ends = ~standing & (self.frames >= SHORTEST_STANCE)
        self.ended_slides.append(self.slid[ends])
        stays = standing & (self.frames > 0)
        moved = np.hypot(*(toes - before)[..., ::2].transpose(2, 0, 1))
        self.slid = np.where(stays, self.slid + moved, 0.0)
        self.frames = np.where(standing, self.frames + 1, 0)


def turn_angles(now: Array, before: Array) -> Array:
    """(...) angle between the rotations `now` and `before` (..., 4), degrees."""
    dot = np.abs(np.sum(now * before, axis=-1))
    return np.asarray(np.degrees(2 * np.arccos(np.minimum(1.0, dot))))


@dataclass
class WorstPoses:
    """The worst values of all characters in the frames so far.

    `soak` explains the names. There most of them end in the unit, such as `hips_lowest_cm`.
    """

    finite: bool = True
    hips_lowest: float = np.inf
    hips_highest: float = -np.inf
    network_turn: float = 0.0
    turn: float = 0.0
    added_turn: float = 0.0
    fastest_joint: float = 0.0
    frames_beyond: int = 0

    def add_heights(self, hips: Array) -> None:
        """Add the heights (C,) of the hips above the ground in a frame, cm."""
        self.hips_lowest = min(self.hips_lowest, float(hips.min()))
        self.hips_highest = max(self.hips_highest, float(hips.max()))

    def add_movement(self, now: tuple[Array, ...], before: tuple[Array, ...]) -> None:
        """Add the movement from the frame `before` to the frame `now`.

        Each frame has three arrays: positions (C, J, 3) of the joints, cm; their rotations (C, J, 4) as
        drawn; and their rotations (C, J, 4) before the feet are placed on the ground.
        """
        turn, network_turn = turn_angles(now[1], before[1]), turn_angles(now[2], before[2])
        added = turn - network_turn
        self.turn = max(self.turn, float(turn.max()))
        self.network_turn = max(self.network_turn, float(network_turn.max()))
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
    """The result of `soak`, which explains the keys."""

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
    """Move each of `characters` for `frames` frames. Returns the worst values over all of these.

    `finite`: whether all numbers are finite. `hips_lowest_cm`, `hips_highest_cm`: smallest and largest height
    of the hips above the ground under them. `network_turn_degrees`: largest turn of a joint in one frame,
    before the feet are placed on the ground. `turn_degrees`: largest turn as drawn, with the feet placed.
    `added_turn_degrees`: the most by which placing the feet makes a turn larger. `frames`: number of frames
    of all characters together. `frames_beyond`: in how many of these frames the added turn exceeds its limit.
    `fastest_joint_cm`: largest movement of a joint in one frame. `slide_cm`: mean slide of a toe in a stance;
    None without a stance. `stances`: number of stances. `holds`: whether all values are within LIMITS.
    """
    rng = np.random.default_rng(seed)
    skeleton = network.skeleton
    assert skeleton is not None
    starts = np.zeros((characters, 3))
    starts[:, 0] = START_SPACING_CM * np.arange(characters)
    animation = ProceduralAnimation(
        network, characters=characters, position=starts, **dict(runtime or Runtime())
    )
    ground = varied_ground(characters, rng)
    targets = Targets.undrawn(characters, dict(network.layout.channels))
    hips = skeleton.role("hips")
    toes = [skeleton.role("left_toe"), skeleton.role("right_toe")]
    worst = WorstPoses()
    slides = StanceSlides(np.zeros((characters, 2)), np.zeros((characters, 2), int))
    before: tuple[Array, ...] | None = None
    for _ in range(frames):
        targets.renew(rng)
        pose = animation.next_pose(
            targets.velocity, targets.facing, targets.gait, terrain=ground, **targets.channels
        )
        worst.finite &= bool(np.isfinite(pose.positions).all() and np.isfinite(pose.rotations).all())
        x, y, z = pose.positions[:, hips].T
        worst.add_heights(y - ground(x, z))
        now = pose.positions, pose.rotations, animation.state.joint_rotation.copy()
        if before is not None:
            worst.add_movement(now, before)
            toe_contacts = pose.contacts[:, 1::2]
            slides.add(now[0][:, toes], before[0][:, toes], toe_contacts >= STANCE)
        before = now
    slide = np.concatenate(slides.ended_slides)
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


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("network", help="weights.npz, a folder that holds it, or a folder of .bin files")
    parser.add_argument("--characters", type=int, default=200)
    parser.add_argument("--frames", type=int, default=5000, help="of each character")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--mode", default="constant", help="phase mode of the network")
    parser.add_argument("--without-locking", action="store_true", help="feet are only kept out of the ground")
    parser.add_argument(
        "--skeleton", default="config/skeletons/holden31.yaml", help="where the network has none"
    )
    arguments = parser.parse_args()
    if arguments.characters < 2:
        parser.error("--characters: at least 2")
    try:
        network = load_network(arguments.network, arguments.skeleton)
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 2
    found = soak(
        network,
        arguments.characters,
        arguments.frames,
        arguments.seed,
        Runtime(mode=arguments.mode, foot_locking=not arguments.without_locking),
    )
    for name, value in found.items():
        print(f"{name:<24}{value}")
    print(f"{'holds' if found['holds'] else 'DOES NOT HOLD'}: {LIMITS}")
    return 0 if found["holds"] else 1


if __name__ == "__main__":
    sys.exit(main())
