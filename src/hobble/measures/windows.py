"""Windows: seconds of straight walking, captured or generated, in which a recogniser finds what it learnt."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.gait.recognise import SHRINKAGE, Discriminant, learn
from hobble.measures.walks import FPS, gait_features, walk_straight
from hobble.models.network import Network
from hobble.rows.clip_rows import Captured
from hobble.rows.layout import GAITS
from hobble.runtime.options import Runtime

WINDOW, STEP = 60, 15  # frames: length of a window (about a cycle), and from one start to the next
AHEAD = 0.9  # a window is straight if at least this share of its mean velocity points forward
LEAST_SPEED = 0.5  # cm a frame; a slower window does not count as walking
WARM_UP, USED = 4 * FPS, 6 * FPS  # frames skipped at the start of a generated walk, and frames used
Values = Mapping[str, float]  # feature -> value
# A function of the type of `gait_features`.
Features = Callable[..., dict[str, float]]
# What a generated walk is asked for: channel -> column -> value (others are 0), and speed, cm a frame.
Asked = tuple[Mapping[str, Mapping[str, float]], float]


@dataclass(frozen=True)
class Window:
    """A window of a walk.

    clip: name of the captured clip or generated walk. label: what a recogniser is to find in it. values: its
    features. severity: the highest of any link. part: in which part of its stretch it lies, from 0.
    """

    clip: str
    label: str
    values: Values = field(repr=False)
    severity: float = 0.0
    part: int = 0


def straight_windows(stretch: Captured, start: int = 0, stop: int | None = None) -> Iterator[slice]:
    """The frames of each window, between two frames of a stretch, in which the person walks ahead."""
    walk_share = stretch.gait[:, GAITS.index("walk")]
    for first in range(start, (len(stretch) if stop is None else stop) - WINDOW + 1, STEP):
        span = slice(first, first + WINDOW)
        velocity = stretch.velocity[span].mean(axis=0)
        speed = np.hypot(*velocity)
        if walk_share[span].mean() > 0.5 and velocity[1] >= AHEAD * speed and speed >= LEAST_SPEED:
            yield span


def captured_values(
    network: Network, stretch: Captured, span: slice, features: Features = gait_features
) -> Values:
    """The features of a window of a captured stretch."""
    return features(network.skeleton, *(a[span] for a in (stretch.local, stretch.contacts, stretch.root)))


def generated_values(
    network: Network, walks: Sequence[Asked], runtime: Runtime, features: Features = gait_features
) -> list[list[Values]]:
    """For each walk, the features of the windows of the network's straight walk."""
    cases = [{name: values.get(name, {}) for name in network.channels} for values, _ in walks]
    speeds = [speed for _, speed in walks]
    found = walk_straight(network, cases, "walk", speeds, [WARM_UP + USED], runtime)
    motion = (found.local, found.contacts, found.root)
    spans = [slice(first, first + WINDOW) for first in range(WARM_UP, WARM_UP + USED - WINDOW + 1, STEP)]
    return [
        [features(network.skeleton, *(a[span, i] for a in motion)) for span in spans]
        for i in range(len(walks))
    ]


def feature_table(values: Sequence[Values]) -> Array:
    """(n, D) values of the D features in n windows."""
    return np.array([list(of_window.values()) for of_window in values])


def learn_windows(windows: Sequence[Window], shrinkage: float = SHRINKAGE) -> Discriminant:
    """A recogniser of the labels of windows."""
    return learn(feature_table([w.values for w in windows]), [w.label for w in windows], shrinkage)


def named_left_out(
    windows: Sequence[Window], groups: Sequence[Any], shrinkage: float = SHRINKAGE
) -> np.ndarray:
    """(n,) the label that a recogniser gives to each of n windows, which learnt from all other groups.

    groups: of each window. "" if the other groups have fewer than two labels.
    """
    named, group = np.full(len(windows), "", object), np.array(groups)
    for left_out in np.unique(group):
        others = [w for w, own in zip(windows, group == left_out, strict=True) if not own]
        if len({w.label for w in others}) > 1:
            own = np.flatnonzero(group == left_out)
            table = feature_table([windows[int(i)].values for i in own])
            named[own] = learn_windows(others, shrinkage).likeliest_classes(table)
    return named
