"""Many figures walk at once. Each follows its own script of speeds, gaits and channel values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array
from hobble.evaluation.motion_measures import in_root_coordinates
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.options import Runtime

FPS = 60
SPEEDS = {"walk": 2.5, "jog": 7.0}  # target speeds, cm a frame
VELOCITY, GAIT = "target_velocity", "gait"  # the names of the targets that are not channels
# Share of the frames of a `CrowdTarget` that pass before it is measured, as channels and gait still change.
SETTLING_SHARE = 0.25


@dataclass(frozen=True)
class CrowdTarget:
    """A stretch of `frames` frames in which each of C figures has a constant target.

    gait: (C,) names. channels: name -> (C, columns). speed: (C,) cm a frame; None: the SPEEDS of the gaits.
    """

    frames: int
    gait: Sequence[str]
    channels: Mapping[str, Array] = field(default_factory=dict, repr=False)
    speed: Sequence[float] | None = None


@dataclass(frozen=True)
class Walks:
    """The motion of C figures over F frames and S stretches (one for each `CrowdTarget`).

    local: (F, C, J, 3) joint positions in root coordinates, cm, float32. contacts: (F, C, 4). phase: (F, C).
    root: (F, C, 3) positions of the root in the world, cm. acceleration: (F, C) the largest of any joint, cm
    per frame squared, 0 in the first and last frame. starts: (S + 1,) first frame of each stretch, then F.
    """

    local: Array = field(repr=False)
    contacts: Array = field(repr=False)
    phase: Array = field(repr=False)
    root: Array = field(repr=False)
    acceleration: Array = field(repr=False)
    starts: np.ndarray

    def of(self, figures: slice) -> Walks:
        """The motion of some of the figures."""
        return Walks(
            self.local[:, figures],
            self.contacts[:, figures],
            self.phase[:, figures],
            self.root[:, figures],
            self.acceleration[:, figures],
            self.starts,
        )

    def measured(self, stretch: int, figure: int) -> slice:
        """The frames of a stretch in which a figure is measured.

        The first SETTLING_SHARE of the stretch is left out. Of the rest, the figure's last whole cycles are
        measured, or all frames if there is no whole cycle.
        """
        start, stop = int(self.starts[stretch]), int(self.starts[stretch + 1])
        start += round(SETTLING_SHARE * (stop - start))
        cycles = np.concatenate([[0.0], np.cumsum(np.mod(np.diff(self.phase[start:stop, figure]), 1.0))])
        whole = np.floor(cycles[-1])
        if whole < 1:
            return slice(start, stop)
        return slice(start + int(np.searchsorted(cycles, cycles[-1] - whole)), stop)


def run(network: Network, script: Sequence[CrowdTarget], runtime: Runtime) -> Walks:
    """The motion of figures that follow `script`. They begin standing and walk straight ahead on flat ground.

    Figures with the same targets move in the same way, to the last bit, until their targets first differ. So
    until then, one character of the animation walks for all of them.
    """
    assert network.skeleton is not None
    count, frames = len(script[0].gait), sum(s.frames for s in script)
    animation = ProceduralAnimation(network, **dict(runtime))
    walker = np.zeros(count, int)  # the character that walks for each figure
    local = np.zeros((frames, count, len(network.skeleton.joints), 3), np.float32)
    contacts, root = np.zeros((frames, count, 4)), np.zeros((frames, count, 3))
    phase, acceleration = np.zeros((frames, count)), np.zeros((frames, count))
    before: list[Array] = []  # joint positions of up to three frames
    f = 0
    for stretch in script:
        target = _targets(network, stretch)
        first, new_walker = _grouped_by_target(walker, *target.values())
        if len(first) > animation.characters:
            came_from = walker[first]
            animation, before = animation.copies(came_from), [p[came_from] for p in before]
            walker = new_walker
        target_now = {name: values[_first_of(walker)] for name, values in target.items()}
        velocity, shares = target_now.pop(VELOCITY), target_now.pop(GAIT)
        for _ in range(stretch.frames):
            pose = animation.next_pose(velocity, gait=shares, **target_now)
            # A single character has no leading axis.
            positions, roots = pose.positions.reshape(len(shares), -1, 3), np.atleast_2d(pose.root)
            root[f], phase[f] = roots[walker], np.atleast_1d(pose.phase)[walker]
            contacts[f] = np.atleast_2d(pose.contacts)[walker]
            local[f] = in_root_coordinates(positions, roots, np.atleast_1d(pose.yaw))[walker]
            before = [*before[-2:], positions]
            if len(before) == 3:
                second = before[2] - 2 * before[1] + before[0]  # second difference
                squared = np.einsum("cjk,cjk->cj", second, second)
                acceleration[f - 1] = np.sqrt(np.max(squared, axis=1))[walker]
            f += 1
    starts = np.cumsum([0, *(s.frames for s in script)])
    return Walks(local, contacts, phase, root, acceleration, starts)


def _targets(network: Network, stretch: CrowdTarget) -> dict[str, Array]:
    """The targets of C figures in a stretch: VELOCITY (C, 2), GAIT (C, 6) shares, channel -> (C, columns)."""
    velocity = np.zeros((len(stretch.gait), 2))
    velocity[:, 1] = [SPEEDS[name] for name in stretch.gait] if stretch.speed is None else stretch.speed
    shares = np.array([[float(name == gait) for name in network.gaits] for gait in stretch.gait])
    return {VELOCITY: velocity, GAIT: shares, **stretch.channels}


def _grouped_by_target(walker: np.ndarray, *targets: Array) -> tuple[np.ndarray, np.ndarray]:
    """Groups figures that one character can walk for: those with the same character and the same targets.

    walker: (C,) the character that has walked for each figure. targets: (C, n) arrays. Returns the first
    figure of each group (groups,), and the group of each figure (C,).
    """
    alike = np.column_stack([walker, *targets])
    _, first, group = np.unique(alike, axis=0, return_index=True, return_inverse=True)
    return first, group.reshape(-1)


def _first_of(walker: np.ndarray) -> np.ndarray:
    """The first figure of each character. walker: (C,) the character that walks for each figure."""
    return np.unique(walker, return_index=True)[1]


def channel_values(network: Network, name: str, figures: Sequence[Mapping[str, float]]) -> dict[str, Array]:
    """{name: (C, columns) values} for `CrowdTarget.channels`, or {} if the network lacks the channel `name`.

    figures: for each figure, name of a column -> value; the other columns are 0.
    """
    columns = network.channels.get(name)
    if columns is None:
        return {}
    out = np.zeros((len(figures), len(columns)))
    for row, values in zip(out, figures, strict=True):
        for column, value in values.items():
            row[columns.index(column)] = value
    return {name: out}
