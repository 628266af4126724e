"""Scripted scenarios (walk, jog, strafe, ...) for the report and the BVH files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.shown import sweeps
from hobble.core.files import save_npz
from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.export import export_bvh, fitted_skeleton
from hobble.runtime.options import Runtime

Target = tuple[Array, Array | None, str]  # velocity, facing, gait


@dataclass(frozen=True)
class Scenario:
    """A script of `frames` frames.

    target: frame -> velocity (2,) in cm a frame, facing (2,) or None to look where the character goes, and
    gait. swept: the channel, and its column whose value rises from 0 to the highest during the script; None:
    all values are 0.
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
    (F, 3) cm, on the ground. gait: (F,) names of the target gait. swept_values: (F,) of the swept column, 0
    if there is none.
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
    """The seven scenarios for every network, and a walk for each value that `swept` lists."""
    facing = _vector(1.0)
    out = [
        Scenario("walk", 900, lambda f: (_vector(2.5, max(0, f - 300) * 0.5), None, "walk")),
        Scenario("jog", 900, lambda f: (_vector(7.0, max(0, f - 300) * 0.5), None, "jog")),
        Scenario("crouch", 600, lambda f: (_vector(2.0), None, "crouch")),
        Scenario("strafe", 600, lambda f: (_vector(2.5, 90 if f % 300 < 150 else -90), facing, "walk")),
        Scenario("backward", 480, lambda f: (_vector(2.0, 180), facing, "walk")),
        Scenario("stop_and_go", 720, lambda f: (_vector(2.5 if f % 240 < 150 else 0.0), None, "walk")),
        Scenario("turn_in_place", 600, lambda f: (_vector(0.0), _vector(1.0, 90 * (f // 120)), "walk")),
    ]
    taken = {scenario.name for scenario in out}
    for name, column in swept(network).items():
        unused_name = name if name not in taken else "_".join((column[0], name))
        out.append(Scenario(unused_name, 720, lambda f: (_vector(2.5), None, "walk"), column))
    return out


def swept(network: Network) -> dict[str, tuple[str, str]]:
    """The scenarios with a swept value: name -> channel and column. Empty without channels or skeleton."""
    if network.skeleton is None:
        return {}
    return {
        name: (group, column)
        for group, columns in network.channels.items()
        for name, column in sweeps(group, network.skeleton, columns, network.trained(group)).items()
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


def generate(network: Network, npz: str | Path, bvh: str | Path, options: Runtime) -> None:
    """Run every scenario; write all of them to the file `npz`, and each to a BVH file in the folder `bvh`.

    npz: names (N,), joints (J,), parents (J,), fps; for each scenario <name>: <name>/positions (F, J, 3)
    float32 cm, <name>/rotations (F, J, 4) world, w first, <name>/contacts (F, 4), <name>/phase (F,),
    <name>/gait (F,) str, <name>/target (F, 2), <name>/root (F, 3), <name>/swept_values (F,) float32 of the
    swept column, <name>/swept (2,) channel and column, both "" if nothing is swept.
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
