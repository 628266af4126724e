"""Generates motion from scripts, the scenarios (walk, jog, strafe, ...), for the report and the BVH files.

In some scenarios the value of a channel's column is swept: it rises from 0 to the highest. A channel is a
group of network inputs that tell, for example, how hurt each part of the body is.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hobble.channels import channel
from hobble.channels.shown import channel_display
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
        for name, column in channel_display(
            of_channel, skeleton, columns, network.trained_labels(of_channel)
        ).sweeps.items()
    }


def run_scenario(network: Network, scenario: Scenario, options: Runtime) -> dict[str, np.ndarray]:
    """Generate one scenario of F frames on flat ground.

    Returns positions (F, J, 3), world, cm; rotations (F, J, 4), world; contacts (F, 4) from 0 to 1, of left
    heel, left toe, right heel and right toe; phase (F,), cycles; root (F, 3) on the ground, cm; target (F, 2)
    velocity, cm a frame; swept_values (F,) of the swept column, 0 if there is none; gait (F,) names of the
    target gaits.
    """
    animation, poses = ProceduralAnimation(network, **dict(options)), []
    values = np.zeros(scenario.frames, np.float32)
    targets = [scenario.target(f) for f in range(scenario.frames)]
    for f, (velocity, facing, gait) in enumerate(targets):
        channels = {}
        if scenario.swept:
            name, column = scenario.swept
            values[f] = channel(name).highest * f / max(1, scenario.frames - 1)
            channels = {name: {column: float(values[f])}}
        poses.append(animation.next_pose(velocity, facing, gait, **channels))
    of_poses = ("positions", "rotations", "contacts", "phase", "root")
    return {
        **{key: np.array([getattr(pose, key) for pose in poses]) for key in of_poses},
        "target": np.array([velocity for velocity, _, _ in targets]),
        "swept_values": values,
        "gait": np.array([gait for _, _, gait in targets]),
    }


def write_motions(
    network: Network, bvh: str | Path, options: Runtime
) -> Iterator[tuple[Scenario, dict[str, np.ndarray]]]:
    """Run every scenario, write each as a BVH file into the folder `bvh`, and yield its motion."""
    assert network.skeleton is not None
    for scenario in scenarios(network):
        motion = run_scenario(network, scenario, options)
        at = motion["positions"], motion["rotations"]
        # A network file without a skeleton was trained on a body other than this skeleton.
        body = network.skeleton if "skeleton" in network.meta else fitted_skeleton(network.skeleton, *at)
        export_bvh(Path(bvh) / f"{scenario.name}.bvh", scenario.name, body, *at)
        yield scenario, motion


def generate_scenarios(network: Network, npz: str | Path, bvh: str | Path, options: Runtime) -> None:
    """Run every scenario; write all of them to the file `npz`, and each to a BVH file in the folder `bvh`.

    The file has names (N,) of the scenarios, joints (J,) names, parents (J,) and fps. For each scenario it
    has <name>/<key> for the keys of `run_scenario`, numbers as float32, and <name>/swept (2,), channel and
    column, both "" if nothing is swept.
    """
    assert network.skeleton is not None
    arrays: dict[str, np.ndarray] = {}
    names = []
    for scenario, motion in write_motions(network, bvh, options):
        names.append(scenario.name)
        for key, values in motion.items():
            arrays[f"{scenario.name}/{key}"] = values if key == "gait" else values.astype(np.float32)
        arrays[f"{scenario.name}/swept"] = np.array(scenario.swept or ("", ""))
    skeleton = network.skeleton
    facts = {"names": names, "joints": skeleton.joints, "parents": skeleton.parents, "fps": 60.0}
    save_npz(npz, **{key: np.array(value) for key, value in facts.items()}, **arrays)
