"""Generates motion from scripts, the scenarios (walk, jog, strafe, ...), for the report and the BVH files.

In some scenarios the value of a channel's column is swept: it rises from 0 to the highest. A channel is a
group of network inputs that tell, for example, how hurt each part of the body is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.shown import channel_sweeps
from hobble.core.files import save_npz
from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.export import export_bvh, fitted_skeleton
from hobble.runtime.options import Runtime

# Velocity (2,), cm a frame; facing (2,), or None to look where the character goes; gait.
Target = tuple[Array, Array | None, str]


@dataclass(frozen=True)
class Scenario:
    """A script of `frames` frames at 60 Hz.

    target: function from the frame's number to the target. swept: channel and column of the value that rises
    from 0 to the channel's highest during the script; None: all values are 0.
    """

    name: str
    frames: int
    target: Callable[[int], Target] = field(repr=False)
    swept: tuple[str, str] | None = None


@dataclass(frozen=True)
class Track:
    """The motion of a scenario with F frames.

    positions: (F, J, 3) world, cm. rotations: (F, J, 4) world. contacts: (F, 4) from 0 to 1, of left heel,
    left toe, right heel and right toe. phase: (F,) cycles. target: (F, 2) target velocity, cm a frame. root:
    (F, 3) position of the root on the ground, cm. gait: (F,) name of the target gait. swept_values: (F,)
    value of the swept column, 0 if there is none.
    """

    scenario: Scenario
    positions: Array
    rotations: Array
    contacts: Array
    phase: Array
    target: Array
    root: Array
    gait: Array
    swept_values: Array


def _vector(length: float, degrees: float = 0.0) -> Array:
    """(2,) x and z of a velocity or facing. degrees: from +Z toward +X (left)."""
    return length * np.array([np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])


def scenarios(network: Network) -> list[Scenario]:
    """The seven scenarios for every network, and a walk for each column that `swept_columns` lists."""
    facing = _vector(1.0)
    out = [
        # Five seconds straight ahead, then a curve of half a degree a frame.
        Scenario("walk", 900, lambda f: (_vector(2.5, max(0, f - 300) * 0.5), None, "walk")),
        Scenario("jog", 900, lambda f: (_vector(7.0, max(0, f - 300) * 0.5), None, "jog")),
        Scenario("crouch", 600, lambda f: (_vector(2.0), None, "crouch")),
        Scenario("strafe", 600, lambda f: (_vector(2.5, 90 if f % 300 < 150 else -90), facing, "walk")),
        Scenario("backward", 480, lambda f: (_vector(2.0, 180), facing, "walk")),
        Scenario("stop_and_go", 720, lambda f: (_vector(2.5 if f % 240 < 150 else 0.0), None, "walk")),
        Scenario("turn_in_place", 600, lambda f: (_vector(0.0), _vector(1.0, 90 * (f // 120)), "walk")),
    ]
    taken = {scenario.name for scenario in out}
    for name, column in swept_columns(network).items():
        unused_name = name if name not in taken else "_".join((column[0], name))
        out.append(Scenario(unused_name, 720, lambda f: (_vector(2.5), None, "walk"), column))
    return out


def swept_columns(network: Network) -> dict[str, tuple[str, str]]:
    """The scenarios with a swept value: name -> channel and column. Empty without channels or skeleton."""
    skeleton = network.skeleton
    if skeleton is None:
        return {}
    return {
        name: (of_channel, column)
        for of_channel, columns in network.channels.items()
        for name, column in channel_sweeps(
            of_channel, skeleton, columns, network.trained_labels(of_channel)
        ).items()
    }


def run_scenario(network: Network, scenario: Scenario, options: Runtime) -> Track:
    """Generate one scenario on flat ground."""
    animation = ProceduralAnimation(network, **dict(options))
    poses, targets, gaits, values = [], [], [], np.zeros(scenario.frames, np.float32)
    for f in range(scenario.frames):
        velocity, facing, gait = scenario.target(f)
        channels = {}
        if scenario.swept:
            name, column = scenario.swept
            values[f] = channel(name).highest * f / max(1, scenario.frames - 1)
            channels = {name: {column: float(values[f])}}
        poses.append(animation.next_pose(velocity, facing, gait, **channels))
        targets.append(velocity)
        gaits.append(gait)
    return Track(
        scenario,
        np.array([p.positions for p in poses]),
        np.array([p.rotations for p in poses]),
        np.array([p.contacts for p in poses]),
        np.array([p.phase for p in poses]),
        np.array(targets),
        np.array([p.root for p in poses]),
        np.array(gaits),
        values,
    )


def write_motions(network: Network, bvh: str | Path, options: Runtime) -> Iterator[Track]:
    """Run every scenario, write each as a BVH file into the folder `bvh`, and yield its motion."""
    assert network.skeleton is not None
    for scenario in scenarios(network):
        track = run_scenario(network, scenario, options)
        body = network.skeleton
        if "skeleton" not in network.meta:  # trained on a body other than this skeleton
            body = fitted_skeleton(body, track.positions, track.rotations)
        export_bvh(Path(bvh) / f"{scenario.name}.bvh", scenario.name, body, track.positions, track.rotations)
        yield track


def generate_scenarios(network: Network, npz: str | Path, bvh: str | Path, options: Runtime) -> None:
    """Run every scenario; write all of them to the file `npz`, and each to a BVH file in the folder `bvh`.

    The file has names (N,) of the scenarios, joints (J,) names, parents (J,) and fps. For each scenario it
    has, as float32, <name>/positions, <name>/rotations (w first), <name>/contacts, <name>/phase,
    <name>/target, <name>/root and <name>/swept_values, which `Track` describes. It also has <name>/gait (F,)
    str and <name>/swept (2,), channel and column, both "" if nothing is swept.
    """
    assert network.skeleton is not None
    arrays: dict[str, Any] = {}
    names = []
    for track in write_motions(network, bvh, options):
        name = track.scenario.name
        names.append(name)
        for key in ("positions", "rotations", "contacts", "phase", "target", "root", "swept_values"):
            arrays[f"{name}/{key}"] = getattr(track, key).astype(np.float32)
        arrays[f"{name}/gait"] = track.gait
        arrays[f"{name}/swept"] = np.array(track.scenario.swept or ("", ""))
    save_npz(
        npz,
        names=np.array(names),
        joints=np.array(network.skeleton.joints),
        parents=np.array(network.skeleton.parents),
        fps=np.array(60.0),
        **arrays,
    )
