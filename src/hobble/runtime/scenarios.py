"""Scripted scenarios: what a network's character is asked to do for the report and the BVH files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import save_npz
from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.export import export_bvh, fitted_skeleton
from hobble.runtime.options import Runtime

Wish = tuple[Array, Array | None, str]  # velocity, facing, gait

HURTS = "injury"  # the channel that they sweep
# The hurt of the injury scenarios: name -> links, by the roles of their ends.
HURT = {
    "left_knee": ("left_hip", "left_knee"),
    "right_knee": ("right_hip", "right_knee"),
    "left_ankle": ("left_knee", "left_heel"),
    "lower_back": ("hips", "spine"),
    "left_arm": ("left_shoulder", "left_elbow"),
}


@dataclass(frozen=True)
class Scenario:
    """`frames` of wishes: wish(frame) gives velocity (2,) cm a frame, facing (2,) or None, and gait.

    hurt: the link whose severity climbs from 0 to 10 over the walk, or None.
    """

    name: str
    frames: int
    wish: Callable[[int], Wish] = field(repr=False)
    hurt: str | None = None


@dataclass(frozen=True)
class Track:
    """What came of a scenario: positions (F, J, 3), rotations (F, J, 4), contacts (F, 4), phase (F,), target
    (F, 2), root (F, 3), gait (F,) names, severity (F,) of the hurt link."""

    scenario: Scenario
    positions: Array
    rotations: Array
    contacts: Array
    phase: Array
    target: Array
    root: Array
    gait: Array
    severity: Array


def _ahead(speed: float, degrees: float = 0.0) -> Array:
    return speed * np.array([np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])


def scenarios(network: Network) -> list[Scenario]:
    """The scenarios of a network; injuries for those that know severities."""
    facing = _ahead(1.0)
    out = [
        Scenario("walk", 900, lambda f: (_ahead(2.5, max(0, f - 300) * 0.5), None, "walk")),
        Scenario("jog", 900, lambda f: (_ahead(7.0, max(0, f - 300) * 0.5), None, "jog")),
        Scenario("crouch", 600, lambda f: (_ahead(2.0), None, "crouch")),
        Scenario("strafe", 600, lambda f: (_ahead(2.5, 90 if f % 300 < 150 else -90), facing, "walk")),
        Scenario("backward", 480, lambda f: (_ahead(2.0, 180), facing, "walk")),
        Scenario("stop_and_go", 720, lambda f: (_ahead(2.5 if f % 240 < 150 else 0.0), None, "walk")),
        Scenario("turn_in_place", 600, lambda f: (_ahead(0.0), _ahead(1.0, 90 * (f // 120)), "walk")),
    ]
    for name, link in hurt_links(network).items():
        out.append(Scenario(name, 720, lambda f: (_ahead(2.5), None, "walk"), link))
    return out


def hurt_links(network: Network) -> dict[str, str]:
    """Which links the injury scenarios hurt: name -> link; empty for a network without severities."""
    skeleton = network.skeleton
    if skeleton is None or not network.links:
        return {}
    out = {}
    for name, (upper, lower) in HURT.items():
        child, top = skeleton.role(lower), skeleton.role(upper)
        path = [child]
        while path[-1] != top and skeleton.parents[path[-1]] >= 0:
            path.append(skeleton.parents[path[-1]])
        # The link nearest the upper joint, of those that were hurt in training if any.
        pairs = [f"{skeleton.joints[p]}-{skeleton.joints[c]}" for c, p in pairwise(path)]
        for links in (network.hurt_links, network.links):
            if name not in out and (known := [pair for pair in reversed(pairs) if pair in links]):
                out[name] = known[0]
    return out


def run_scenario(network: Network, scenario: Scenario, options: Runtime) -> Track:
    """Generate one scenario on flat ground."""
    animation = ProceduralAnimation(network, **dict(options))
    poses, targets, gaits, severity = [], [], [], np.zeros(scenario.frames, np.float32)
    for f in range(scenario.frames):
        velocity, facing, gait = scenario.wish(f)
        told = {}
        if scenario.hurt:
            severity[f] = 10.0 * f / max(1, scenario.frames - 1)
            told = {HURTS: {scenario.hurt: float(severity[f])}}
        poses.append(animation.next_pose(velocity, facing, gait, **told))
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
        severity,
    )


def write_motions(network: Network, bvh: str | Path, options: Runtime) -> Iterator[Track]:
    """Run every scenario, write each as a BVH file into the folder `bvh` and yield what came of it."""
    assert network.skeleton is not None
    for scenario in scenarios(network):
        track = run_scenario(network, scenario, options)
        own = "skeleton" in network.meta
        body = (
            network.skeleton if own else fitted_skeleton(network.skeleton, track.positions, track.rotations)
        )
        export_bvh(Path(bvh) / f"{scenario.name}.bvh", scenario.name, body, track.positions, track.rotations)
        yield track


def generate(network: Network, npz: str | Path, bvh: str | Path, options: Runtime) -> None:
    """Run every scenario and write `npz` and, into the folder `bvh`, a BVH file each.

    npz: names (N,), joints (J,), parents (J,), fps; for scenario <name>: <name>/positions (F, J, 3) float32
    cm, <name>/rotations (F, J, 4) world, w first, <name>/contacts (F, 4), <name>/phase (F,), <name>/gait (F,)
    str, <name>/target (F, 2), <name>/root (F, 3), <name>/severity (F,) float32, <name>/hurt: the hurt link or
    "".
    """
    assert network.skeleton is not None
    arrays: dict[str, Any] = {}
    names = []
    for track in write_motions(network, bvh, options):
        name = track.scenario.name
        names.append(name)
        for key in ("positions", "rotations", "contacts", "phase", "target", "root", "severity"):
            arrays[f"{name}/{key}"] = getattr(track, key).astype(np.float32)
        arrays[f"{name}/gait"] = track.gait
        arrays[f"{name}/hurt"] = np.array(track.scenario.hurt or "")
    save_npz(
        npz,
        names=np.array(names),
        joints=np.array(network.skeleton.joints),
        parents=np.array(network.skeleton.parents),
        fps=np.array(60.0),
        **arrays,
    )
