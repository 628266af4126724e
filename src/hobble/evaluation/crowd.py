"""Many figures at once. Each walks by its own script of speeds, gaits and channel values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array
from hobble.evaluation.motion_measures import in_root_frame
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.options import Runtime

FPS = 60
SPEEDS = {"walk": 2.5, "jog": 7.0}  # target speeds, cm a frame
SETTLING_SHARE = 0.25  # share of a stretch, at its beginning, in which channels and gait still change


@dataclass(frozen=True)
class CrowdTarget:
    """A number of frames with a constant target for each of C figures.

    gait: (C,) names. channels: name -> (C, columns). speed: (C,) cm a frame, or None for SPEEDS of the gait.
    """

    frames: int
    gait: Sequence[str]
    channels: Mapping[str, Array] = field(default_factory=dict, repr=False)
    speed: Sequence[float] | None = None


@dataclass(frozen=True)
class Walks:
    """The motion of C figures over F frames and S stretches.

    local: (F, C, J, 3) positions in the root frame, cm, float32. contacts: (F, C, 4). phase: (F, C).
    root: (F, C, 3). acceleration: (F, C) largest of any joint, cm per frame squared, 0 in the first and last
    frame. starts: (S + 1,) first frame of each stretch, then F.
    """

    local: Array = field(repr=False)
    contacts: Array = field(repr=False)
    phase: Array = field(repr=False)
    root: Array = field(repr=False)
    acceleration: Array = field(repr=False)
    starts: np.ndarray

    def of(self, figures: slice) -> Walks:
        """The walks of some figures."""
        return Walks(
            self.local[:, figures],
            self.contacts[:, figures],
            self.phase[:, figures],
            self.root[:, figures],
            self.acceleration[:, figures],
            self.starts,
        )

    def measured(self, stretch: int, figure: int) -> slice:
        """The frames of a stretch to measure: whole cycles of the figure at the end of the stretch.

        If there is no whole cycle after the settling time, all frames after it.
        """
        start, stop = int(self.starts[stretch]), int(self.starts[stretch + 1])
        start += round(SETTLING_SHARE * (stop - start))
        turned = np.concatenate([[0.0], np.cumsum(np.mod(np.diff(self.phase[start:stop, figure]), 1.0))])
        whole = np.floor(turned[-1])
        if whole < 1:
            return slice(start, stop)
        return slice(start + int(np.searchsorted(turned, turned[-1] - whole)), stop)


def run(network: Network, script: Sequence[CrowdTarget], runtime: Runtime) -> Walks:
    """Run figures through `script`, from a stand, straight ahead on flat ground."""
    assert network.skeleton is not None
    count, frames = len(script[0].gait), sum(s.frames for s in script)
    animation = ProceduralAnimation(network, characters=count, **dict(runtime))
    local = np.zeros((frames, count, len(network.skeleton.joints), 3), np.float32)
    contacts, root = np.zeros((frames, count, 4)), np.zeros((frames, count, 3))
    phase, rough = np.zeros((frames, count)), np.zeros((frames, count))
    before: list[Array] = []
    f = 0
    for stretch in script:
        velocity = np.zeros((count, 2))
        velocity[:, 1] = [SPEEDS[name] for name in stretch.gait] if stretch.speed is None else stretch.speed
        shares = np.array([[float(name == gait) for name in network.gaits] for gait in stretch.gait])
        for _ in range(stretch.frames):
            pose = animation.next_pose(velocity, gait=shares, **stretch.channels)
            # A single figure has no leading axis.
            positions = pose.positions.reshape(count, -1, 3)
            root[f], phase[f], contacts[f] = pose.root, pose.phase, pose.contacts
            local[f] = in_root_frame(positions, root[f], np.atleast_1d(pose.yaw))
            before = [*before[-2:], positions]
            if len(before) == 3:
                bend = before[2] - 2 * before[1] + before[0]
                rough[f - 1] = np.sqrt(np.max(np.einsum("cjk,cjk->cj", bend, bend), axis=1))
            f += 1
    starts = np.cumsum([0, *(s.frames for s in script)])
    return Walks(local, contacts, phase, root, rough, starts)


def channel_values(network: Network, name: str, figures: Sequence[Mapping[str, float]]) -> dict[str, Array]:
    """The values of channel `name` for a stretch, or {} if the network does not have that channel.

    figures: column -> value, for each figure.
    """
    columns = network.channels.get(name)
    if columns is None:
        return {}
    out = np.zeros((len(figures), len(columns)))
    for row, values in zip(out, figures, strict=True):
        for column, value in values.items():
            row[columns.index(column)] = value
    return {name: out}
