"""Golden traces: inputs and poses of the Python runtime in ten situations, to check ports against.

A trace file, little-endian: the magic bytes, uint32 version, frames F, joints J, channel columns K, rows and
columns of a grid of ground heights (both 0 on flat ground at 0), seed of the variation, float64 amount of the
variation and cm between two rows or columns of the grid, and its heights as float32, row by row. The grid's
middle is the origin. Then come F records of
float32 numbers. A record has the inputs of a frame: target velocity (2), facing (2; 0, 0: where it goes),
number of the gait (-1: by speed), and the value of each channel column (K); then the pose: root (3), yaw,
phase, contacts (4), positions (J, 3), rotations (J, 4). Units and axes are those of `c/hobble.h`; the
character starts at the origin, facing +Z.
"""

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from hobble.channels import channel
from hobble.channels.shown import channel_display
from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.runtime import Runtime
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.ground import Heightmap

SEED = 7  # of the variation
MAGIC, VERSION, FRAMES = b"HOBTRACE", 2, 600
CELL, SIDE = 20.0, 129  # cm between two heights of the hills, and how many heights they have on a side


def _vector(length: float, degrees: float) -> Array:
    """(2,) x and z. degrees: from +Z toward +X."""
    return length * np.array([np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])


def hills() -> Array:
    """(SIDE, SIDE) float32 heights of hills, cm."""
    z, x = np.mgrid[:SIDE, :SIDE] * CELL
    heights = 14 * np.sin(x / 170) * np.cos(z / 140) + 8 * np.sin((x + z) / 260)
    return np.asarray(heights, np.float32)


def stairs() -> Array:
    """(SIDE, SIDE) float32 heights of five steps up and five down in turn, cm."""
    steps = np.abs(np.arange(SIDE) // 5 % 10 - 5) * 24.0
    return np.repeat(steps[:, None], SIDE, axis=1).astype(np.float32)


@dataclass(frozen=True)
class Situation:
    """velocity, facing: functions from the frame to x and z; facing (0, 0) is where the character goes.

    gait: its name; None: by speed. hurt: whether channel values rise after two seconds. ground: makes the
    heights of the ground; None if it is flat. variation: how much steps differ.
    """

    velocity: Callable[[int], Array]
    facing: Callable[[int], Array] = lambda frame: np.zeros(2)
    gait: str | None = "walk"
    hurt: bool = False
    ground: Callable[[], Array] | None = None
    variation: float = 0.0


SITUATIONS: Mapping[str, Situation] = {
    "walk": Situation(lambda f: _vector(2.5, max(0, f - 200) * 0.5)),
    "jog": Situation(lambda f: _vector(7.0, max(0, f - 200) * 0.3), gait=None),
    "crouch": Situation(lambda f: _vector(2.0, 0.2 * f), gait="crouch"),
    "strafe": Situation(lambda f: _vector(2.5, 90 if f % 300 < 150 else -90), lambda f: _vector(1, 0)),
    "backward": Situation(lambda f: _vector(2.0, 180), lambda f: _vector(1, 0)),
    "stop_and_turn": Situation(
        lambda f: _vector(2.5 if f % 240 < 120 else 0, 0),
        lambda f: _vector(0 if f % 240 < 120 else 1, 90 * (1 + f // 240)),
    ),
    "hurt": Situation(lambda f: _vector(2.5, 0.3 * f), hurt=True),
    "varied": Situation(lambda f: _vector(2.5, 0.3 * f), hurt=True, variation=1.0),
    "hills": Situation(lambda f: _vector(2.5, 0.4 * f), gait=None, hurt=True, ground=hills),
    "stairs": Situation(lambda f: _vector(2.0, 0.0), hurt=True, ground=stairs),
}


def channel_values(network: Network) -> dict[str, dict[str, float]]:
    """Values of all channels of the network: 7 tenths of the highest in two columns of each."""
    assert network.skeleton is not None
    values = {}
    for name, labels in network.channels.items():
        trained = network.trained_labels(name)
        shown = channel_display(name, network.skeleton, labels, trained).sliders.values() or trained
        # As float32, because a port reads these numbers from the file.
        values[name] = dict.fromkeys(list(shown)[:2], float(np.float32(0.7 * channel(name).highest)))
    return values


def trace(
    network: Network, runtime: Runtime, situation: Situation, frames: int, storage: str | None = None
) -> bytes:
    """The trace file of one situation.

    frames: its length. storage: how the weights are stored, as in `hobble.engine.hob.character_bytes`.
    """
    animation = ProceduralAnimation(
        network, storage=storage, variation=situation.variation, seed=SEED, **dict(runtime)
    )
    grid = situation.ground() if situation.ground else np.zeros((0, 0), np.float32)
    terrain = Heightmap(grid, CELL) if situation.ground else None
    hurt = channel_values(network)
    records = []
    for frame in range(frames):
        velocity = np.asarray(situation.velocity(frame), np.float32)
        facing = np.asarray(situation.facing(frame), np.float32)
        values = hurt if situation.hurt and frame >= 120 else {}
        pose = animation.next_pose(velocity, facing, situation.gait, terrain=terrain, **values)
        given = [
            values.get(name, {}).get(label, channel(name).default)
            for name, labels in network.channels.items()
            for label in labels
        ]
        gait = -1 if situation.gait is None else network.gaits.index(situation.gait)
        records.append(
            np.concatenate(
                [
                    *(velocity, facing, [gait], given, pose.root, [pose.yaw, pose.phase], pose.contacts),
                    *(pose.positions.ravel(), pose.rotations.ravel()),
                ]
            ).astype("<f4")
        )
    columns = sum(map(len, network.channels.values()))
    header = VERSION, frames, len(pose.positions), columns, *grid.shape, SEED, situation.variation, CELL
    return struct.pack("<8s7I2d", MAGIC, *header) + grid.astype("<f4").tobytes() + np.array(records).tobytes()
