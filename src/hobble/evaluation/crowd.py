"""Generates the walks of many figures at once. Each figure has its own speeds, gaits and channel values."""

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
# This share of a stretch, at its start, is not measured, because the motion still changes to the new target.
SETTLING_SHARE = 0.25


@dataclass(frozen=True)
class CrowdTarget:
    """The targets of C figures for a stretch of `frames` frames. They are constant in the stretch.

    gait: (C,) names of gaits. channels: name -> values (C, columns). speed: (C,) cm a frame; None: the SPEEDS
    of the gaits, which then have to be keys of SPEEDS.
    """

    frames: int
    gait: Sequence[str]
    channels: Mapping[str, Array] = field(default_factory=dict, repr=False)
    speed: Sequence[float] | None = None


@dataclass(frozen=True)
class Walks:
    """The motion of C figures over F frames, which consist of S stretches, one for each `CrowdTarget`.

    local: (F, C, J, 3) joint positions in root coordinates, cm, float32. contacts: (F, C, 4) predicted
    contacts of left heel, left toe, right heel, right toe. phase: (F, C) from 0 to 1. root: (F, C, 3)
    positions of the root in the world, cm. acceleration: (F, C) the largest of any joint, cm per frame
    squared, 0 in the first and last frame. starts: (S + 1,) first frame of each stretch, then F.
    """

    local: Array = field(repr=False)
    contacts: Array = field(repr=False)
    phase: Array = field(repr=False)
    root: Array = field(repr=False)
    acceleration: Array = field(repr=False)
    starts: np.ndarray

    def of_figures(self, figures: slice) -> Walks:
        """The motion of the figures in the slice `figures`."""
        return Walks(
            self.local[:, figures],
            self.contacts[:, figures],
            self.phase[:, figures],
            self.root[:, figures],
            self.acceleration[:, figures],
            self.starts,
        )

    def measured_frames(self, stretch: int, figure: int) -> slice:
        """The frames of stretch number `stretch` in which figure number `figure` is measured.

        The first SETTLING_SHARE of the stretch is left out. After it, as many whole gait cycles as fit are
        measured, up to the end of the stretch. If not even one fits, all frames after the first share are.
        """
        start, stop = int(self.starts[stretch]), int(self.starts[stretch + 1])
        start += round(SETTLING_SHARE * (stop - start))
        # Cycles that the figure has walked since frame `start`, with fractions.
        cycles = np.concatenate([[0.0], np.cumsum(np.mod(np.diff(self.phase[start:stop, figure]), 1.0))])
        whole = np.floor(cycles[-1])
        if whole < 1:
            return slice(start, stop)
        return slice(start + int(np.searchsorted(cycles, cycles[-1] - whole)), stop)


def generate_walks(network: Network, script: Sequence[CrowdTarget], runtime: Runtime) -> Walks:
    """The motion of C figures that follow `script`. They begin standing and walk ahead on flat ground.

    script: one `CrowdTarget` for each stretch, in order. Figures with the same targets move in the same way,
    to the last bit, until their targets first differ. So, to save time, a single character of the animation
    walks for all of them until then.
    """
    assert network.skeleton is not None
    count, frames = len(script[0].gait), sum(s.frames for s in script)
    animation = ProceduralAnimation(network, **dict(runtime))
    walker = np.zeros(count, int)  # the character that walks for each figure
    local = np.zeros((frames, count, len(network.skeleton.joints), 3), np.float32)
    contacts, root = np.zeros((frames, count, 4)), np.zeros((frames, count, 3))
    phase, acceleration = np.zeros((frames, count)), np.zeros((frames, count))
    recent: list[Array] = []  # joint positions in the world, of the last three frames or fewer
    frame = 0
    for stretch in script:
        target = _targets(network, stretch)
        first, new_walker = _group_by_target(walker, *target.values())
        if len(first) > animation.characters:
            # Figures with one character now have different targets. Each target gets a copy of the character.
            copied = walker[first]  # (new characters,) the character from which each new one is copied
            animation, recent = animation.copies(copied), [p[copied] for p in recent]
            walker = new_walker
        target_now = {name: values[_first_figures(walker)] for name, values in target.items()}
        velocity, shares = target_now.pop(VELOCITY), target_now.pop(GAIT)
        for _ in range(stretch.frames):
            pose = animation.next_pose(velocity, gait=shares, **target_now)
            # The arrays of a single character have no axis for characters. It is added here.
            positions, roots = pose.positions.reshape(len(shares), -1, 3), np.atleast_2d(pose.root)
            root[frame], phase[frame] = roots[walker], np.atleast_1d(pose.phase)[walker]
            contacts[frame] = np.atleast_2d(pose.contacts)[walker]
            local[frame] = in_root_coordinates(positions, roots, np.atleast_1d(pose.yaw))[walker]
            recent = [*recent[-2:], positions]
            if len(recent) == 3:
                second_difference = recent[2] - 2 * recent[1] + recent[0]
                squared = np.einsum("cjk,cjk->cj", second_difference, second_difference)
                acceleration[frame - 1] = np.sqrt(np.max(squared, axis=1))[walker]
            frame += 1
    starts = np.cumsum([0, *(s.frames for s in script)])
    return Walks(local, contacts, phase, root, acceleration, starts)


def _targets(network: Network, stretch: CrowdTarget) -> dict[str, Array]:
    """The targets of C figures in a stretch, by name.

    VELOCITY: (C, 2) to the side and forward, cm a frame. GAIT: (C, 6) shares of the gaits. Name of each
    channel: (C, columns) its values.
    """
    velocity = np.zeros((len(stretch.gait), 2))
    velocity[:, 1] = [SPEEDS[name] for name in stretch.gait] if stretch.speed is None else stretch.speed
    shares = np.array([[float(name == gait) for name in network.gaits] for gait in stretch.gait])
    return {VELOCITY: velocity, GAIT: shares, **stretch.channels}


def _group_by_target(walker: np.ndarray, *targets: Array) -> tuple[np.ndarray, np.ndarray]:
    """Group the figures that had the same character so far and have the same targets from now on.

    walker: (C,) the character that walked for each figure so far. targets: arrays (C, n). Returns (groups,)
    the first figure of each group, and (C,) the group of each figure.
    """
    alike = np.column_stack([walker, *targets])
    _, first, group = np.unique(alike, axis=0, return_index=True, return_inverse=True)
    return first, group.reshape(-1)


def _first_figures(walker: np.ndarray) -> np.ndarray:
    """(characters,) the first figure of each character. walker: (C,) the character of each figure."""
    return np.unique(walker, return_index=True)[1]


def channel_values(network: Network, name: str, figures: Sequence[Mapping[str, float]]) -> dict[str, Array]:
    """{name: values (C, columns)} for `CrowdTarget.channels`, or {} if the network lacks the channel `name`.

    figures: for each of C figures, name of a column -> value. Columns that are not named are 0.
    """
    columns = network.channels.get(name)
    if columns is None:
        return {}
    out = np.zeros((len(figures), len(columns)))
    for row, values in zip(out, figures, strict=True):
        for column, value in values.items():
            row[columns.index(column)] = value
    return {name: out}
