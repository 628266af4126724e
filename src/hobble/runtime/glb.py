"""Writes the character for a game engine: body, skeleton and animations in one glTF file.

The animations are the scripted scenarios of `hobble.runtime.scenarios`, such as a walk or a jog.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from hobble.core.errors import HobbleError
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, local_rotations
from hobble.figure.fit_rotations import fitted_rotations
from hobble.figure.gltf import BodyMotion, write_glb
from hobble.models.network import Network
from hobble.runtime.export import fitted_skeleton, restore_bone_lengths

FPS = 30.0  # poses a second in the file; viewers interpolate between them


def export_glb(path: str | Path, network: Network, scenarios: str | Path) -> None:
    """Write the body of a network's skeleton, with one animation for each scenario.

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
        skeleton = fitted_skeleton(skeleton, *_motion(data, first, skeleton))
    write_glb(path, skeleton, _motions(data, skeleton))


def _motion(data: Mapping[str, Array], name: str, skeleton: Skeleton) -> tuple[Array, Array]:
    """World positions (F, J, 3) and rotations (F, J, 4) of the scenario `name`, thinned to FPS.

    If the file has no rotations, they are computed from the positions.
    """
    frame_step = max(1, round(float(data["fps"]) / FPS))
    positions = np.asarray(data[f"{name}/positions"], float)[::frame_step]
    rotations = data.get(f"{name}/rotations")
    if rotations is None:
        return positions, fitted_rotations(skeleton, positions)
    return positions, np.asarray(rotations, float)[::frame_step]


def _motions(data: Mapping[str, Array], skeleton: Skeleton) -> Iterator[BodyMotion]:
    """The motion of each scenario, thinned to FPS, with constant bone lengths."""
    frame_step = max(1, round(float(data["fps"]) / FPS))
    for name in map(str, data["names"]):
        world_rotations, positions = restore_bone_lengths(skeleton, *_motion(data, name, skeleton))
        local = local_rotations(skeleton, world_rotations)
        yield BodyMotion(name, positions[:, 0], local, float(data["fps"]) / frame_step)
