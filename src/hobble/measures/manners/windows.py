"""Windows (stretches of one second) of straight walking, from captured clips and from generated walks.

A manner is a way of walking, such as a mood. Each column of some channels (`Channel.manner`) is a manner.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hobble.channels import channel
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.evaluation.captured import Captured
from hobble.evaluation.crowd import FPS, CrowdTarget, channel_values, generate_walks
from hobble.evaluation.gait_features import gait_features
from hobble.models.network import Network
from hobble.rows.layout import GAITS
from hobble.runtime.options import Runtime

NONE = "none"  # the manner of a clip whose values are all 0
WALK = GAITS.index("walk")
WINDOW, STEP = 60, 15  # frames: length of a window (about a cycle), and from one start to the next
LEAST_AHEAD = 0.9  # a window is straight if at least this share of its mean velocity points forward
LEAST_SPEED = 0.5  # cm a frame; a slower window does not count as walking
WARM_UP, USED = 4 * FPS, 6 * FPS  # frames skipped at the start of a generated walk, and frames used
# Quantities that are compared between walks with and without a manner. `MannerWindow` has their units.
EFFECTS = ("speed", "stride", "trunk", "arms", "head")


@dataclass(frozen=True)
class MannerWindow:
    """A stretch of straight walking, WINDOW frames long.

    clip: empty for a generated walk. manner: a column of the channel, or NONE; in a generated walk with two
    manners, "<one> and <other>". values: feature -> value, for the recogniser: those of
    `hobble.evaluation.gait_features`, and "head". effects: name in EFFECTS -> value: speed (m/s), stride
    (cm), trunk and head (degrees forward), arms (standard deviation of their swing, degrees).
    """

    clip: str
    manner: str
    values: Mapping[str, float] = field(repr=False)
    effects: Mapping[str, float] = field(repr=False)


@dataclass(frozen=True)
class WalkerInputs:
    """The inputs of a generated walk.

    channels: name of a channel -> name of a column -> value; all other values are 0. speed: target speed, cm
    a frame.
    """

    channels: Mapping[str, Mapping[str, float]]
    speed: float


def captured_windows(clip: Captured, network: Network, name: str) -> list[MannerWindow]:
    """The windows of straight walking in a captured stretch of a clip.

    In each window there is no manner, or one manner at its highest value, and all other channels are 0.
    name: the channel of the manners.
    """
    assert network.skeleton is not None
    columns, highest = network.channels[name], channel(name).highest
    # For each other channel, bool for each frame: whether it has a value above 0.
    others = [np.any(values > 0, axis=1) for other, values in clip.channels.items() if other != name]
    out = []
    for start in range(0, len(clip) - WINDOW + 1, STEP):
        span = slice(start, start + WINDOW)
        speed = np.hypot(*clip.velocity[span].mean(axis=0))
        values = clip.channels[name][start]  # the same in all frames of a clip
        manners = [columns[i] for i in np.flatnonzero(values)]
        straight = clip.velocity[span, 1].mean() >= LEAST_AHEAD * speed and speed >= LEAST_SPEED
        walks = clip.gait[span, WALK].mean() > 0.5
        at_most_one = len(manners) < 2 and np.isin(values, (0, highest)).all()
        if not (straight and walks and at_most_one) or any(np.any(other[span]) for other in others):
            continue
        parts = clip.local[span], clip.contacts[span], clip.root[span]
        out.append(_window(network.skeleton, clip.clip, manners[0] if manners else NONE, *parts))
    return out


def generated_windows(
    network: Network, walkers: Sequence[WalkerInputs], name: str, runtime: Runtime
) -> list[list[MannerWindow]]:
    """For each walker, the windows of a generated straight walk. name: the channel of the manners."""
    assert network.skeleton is not None
    channels: dict[str, Array] = {}
    for key in network.channels:
        channels |= channel_values(network, key, [walker.channels.get(key, {}) for walker in walkers])
    speeds = [walker.speed for walker in walkers]
    script = CrowdTarget(WARM_UP + USED, ["walk"] * len(walkers), channels, speeds)
    walks = generate_walks(network, [script], runtime)
    out = []
    for i, walker in enumerate(walkers):
        manner = " and ".join(walker.channels.get(name, {})) or NONE
        spans = [slice(s, s + WINDOW) for s in range(WARM_UP, WARM_UP + USED - WINDOW + 1, STEP)]
        parts = [(walks.local[span, i], walks.contacts[span, i], walks.root[span, i]) for span in spans]
        out.append([_window(network.skeleton, "", manner, *part) for part in parts])
    return out


def feature_table(windows: Sequence[MannerWindow]) -> Array:
    """(n, D) values of the D features in n windows."""
    return np.array([list(w.values.values()) for w in windows])


def mean_effect(windows: Iterable[MannerWindow], effect: str) -> float:
    """The mean over the windows of the quantity `effect`, one of EFFECTS."""
    return float(np.mean([w.effects[effect] for w in windows]))


def _window(
    skeleton: Skeleton, clip: str, manner: str, local: Array, contacts: Array, root: Array
) -> MannerWindow:
    """A window from its motion. local, contacts, root: as for `gait_features`."""
    values = gait_features(skeleton, local, contacts, root)
    head, neck = (local[:, skeleton.role(part)].astype(float) for part in ("head", "neck"))
    up = (head - neck).mean(axis=0)  # from the neck to the head
    effects = {
        "speed": values["speed"] / 100,
        "stride": values["step_left"] + values["step_right"],
        "trunk": -values["trunk_forward_mean"],  # the feature measures the direction down the trunk
        "arms": (values["upper_arm_left_sd"] + values["upper_arm_right_sd"]) / 2,
        "head": float(np.degrees(np.arctan2(up[2], up[1]))),
    }
    return MannerWindow(clip, manner, {**values, "head": effects["head"]}, effects)
