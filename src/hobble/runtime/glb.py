"""Writes the character for artists and game engines: body, skeleton and animations in one glTF file."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from hobble.channels import channel
from hobble.core.errors import HobbleError
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, local_rotations
from hobble.figure.gltf import BodyMotion, write_glb
from hobble.models.network import Network
from hobble.runtime.export import FPS, fitted_skeleton, restore_bone_lengths
from hobble.runtime.loops import SPEEDS, make_loop
from hobble.runtime.options import Runtime
from hobble.runtime.scenarios import swept_columns

GLB_FPS = 30.0  # poses a second of the scenarios in the file; viewers interpolate between them
LOOP_FRAMES = (40, 150)  # frames at 60 Hz: least and greatest length of a loop in the file
HURT = 0.7  # share of a channel's highest value, with which the hurt loops walk


def export_glb(path: str | Path, network: Network, scenarios: str | Path, runtime: Runtime) -> None:
    """Write the body of a network's skeleton, with loops of each gait and an animation for each scenario.

    path: the .glb file. scenarios: the file runtime/scenarios.npz in the results of a configuration. Raises
    HobbleError for a network without a skeleton.
    """
    if network.skeleton is None:
        raise HobbleError(
            f"cannot write {path}: the network's file has no skeleton, so there is no body. Pass "
            "`load_network` a file of config/skeletons."
        )
    data = load_npz(scenarios)
    skeleton = network.skeleton
    if "skeleton" not in network.meta:  # it is from config/skeletons; the trained body may have other bones
        first = str(data["names"][0])
        skeleton = fitted_skeleton(skeleton, data[f"{first}/positions"], data[f"{first}/rotations"])
    write_glb(path, skeleton, [*_loops(network, skeleton, runtime), *_scenarios(data, skeleton)])


def _loops(network: Network, skeleton: Skeleton, runtime: Runtime) -> Iterator[BodyMotion]:
    """Each gait as a loop, healthy and with each swept value, in place and with the root moving."""
    hurt = {
        f"_{name}": {of_channel: {column: HURT * channel(of_channel).highest}}
        for name, (of_channel, column) in swept_columns(network).items()
    }
    for gait in SPEEDS:
        for name, values in {"": {}, **hurt}.items():
            loop = make_loop(network, values, runtime, gait, LOOP_FRAMES).ahead()
            # Its first pose comes once more at its end.
            positions = np.concatenate([loop.positions, loop.positions[:1] + loop.travel])
            rotations = np.concatenate([loop.rotations, loop.rotations[:1]])
            moving = np.arange(len(positions))[:, None] / len(loop.positions) * loop.travel
            world, places = restore_bone_lengths(skeleton, positions, rotations)
            local = local_rotations(skeleton, world)
            yield BodyMotion(f"{gait}{name}_loop", places[:, 0] - moving, local, FPS)
            yield BodyMotion(f"{gait}{name}_loop_root_motion", places[:, 0], local, FPS, moving)


def _scenarios(data: Mapping[str, Array], skeleton: Skeleton) -> Iterator[BodyMotion]:
    """The motion of each scenario, thinned to GLB_FPS, with constant bone lengths."""
    step = max(1, round(float(data["fps"]) / GLB_FPS))
    for name in map(str, data["names"]):
        positions, rotations, ground = (
            np.asarray(data[f"{name}/{key}"], float)[::step] for key in ("positions", "rotations", "root")
        )
        world, places = restore_bone_lengths(skeleton, positions, rotations)
        local = local_rotations(skeleton, world)
        yield BodyMotion(name, places[:, 0], local, float(data["fps"]) / step, ground * [1.0, 0.0, 1.0])
