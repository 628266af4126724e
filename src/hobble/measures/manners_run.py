"""Measures whether moods and diagnoses (manners) are recognised in generated walks.

The recogniser judges windows, stretches of straight walking of one second, from captured clips and from
generated walks.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait.recognise import Discriminant, learn
from hobble.measures.measure import MeasureInputs, Outcome, Row, SampleOptions
from hobble.measures.sample import captured_motion, sample_to_measure, with_sample
from hobble.measures.walks import (
    FPS,
    CrowdTarget,
    channel_values,
    gait_features,
    generate_walks,
    share_of_true,
)
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.clip_rows import Captured
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
    `gait_features`, and "head". effects: name in EFFECTS -> value: speed (m/s), stride
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


# The recogniser shrinks the covariance of the features towards its diagonal by one of these shares (0 to 1).
# All are tried. A large share is better if there are few clips: .6 recognises 69 % of moods (few clips) and
# 51 % of diagnoses (many clips); .02 recognises 54 % of moods and 63 % of diagnoses.
SHRINKAGES = (0.02, 0.1, 0.3, 0.6)


def recognise_left_out(
    windows: Sequence[MannerWindow], people: Mapping[str, str], shrinkages: Sequence[float] = SHRINKAGES
) -> dict[str, Any]:
    """Recognise the manner in each person's windows after learning from the windows of all other people.

    people: clip -> person. shrinkages: the shares to try, see SHRINKAGES. The result is for the shrinkage
    with which most windows are named right. If several are equally good, it is for the largest of them. A
    manner that only one person has is never recognised, because it cannot be learnt while this person is left
    out.
    """
    values = feature_table(windows)
    manner, person = (
        np.array(names) for names in ([w.manner for w in windows], [people[w.clip] for w in windows])
    )
    results = [_recognise_with_shrinkage(values, manner, person, shrinkage) for shrinkage in shrinkages]
    return max(results, key=lambda result: (result["right"] or 0.0, result["shrinkage"]))


def _recognise_with_shrinkage(
    values: Array, manner: np.ndarray, person: np.ndarray, shrinkage: float
) -> dict[str, Any]:
    """The result for one shrinkage.

    values: (n, D) features of n windows. manner, person: (n,) names of each window's manner and person.
    """
    named = np.full(len(manner), "", object)  # "": the other people have fewer than two manners
    for left_out_person in np.unique(person):
        out = person == left_out_person
        if len(set(manner[~out])) > 1:
            named[out] = learn(values[~out], manner[~out].tolist(), shrinkage).likeliest_classes(values[out])
    tried = named != ""
    right, presence_right = named == manner, (named == NONE) == (manner == NONE)
    pairs = sorted(set(zip(manner.tolist(), person.tolist(), strict=True)))
    return {
        "shrinkage": shrinkage,
        "people": len(set(person)),
        "people_of": {str(m): sum(m == other for other, _ in pairs) for m in sorted(set(manner))},
        "windows": int(tried.sum()),
        "right": share_of_true(right[tried]),
        "by_manner": {
            str(m): share_of_true(right[tried & (manner == m)]) for m in sorted(set(manner[tried]))
        },
        "presence_right": share_of_true(presence_right[tried]),
    }


# Target speeds of generated walks, divided by the median speed of captured neutral walks. They are the same
# for every manner.
PACES = (0.85, 1.0, 1.15)
USUAL_SPEED = 120.0  # cm a second; used instead of this median if there are no captured neutral walks
HALF, FULL = 0.5, 1.0  # values of a manner
NO_MANNERS = "none of this network's inputs is a manner of walking"
TOO_FEW = "fewer than two manners are shown by straight walks in training clips"


def measure_manners(
    network: Network,
    motion: Iterable[Captured],
    splits: Mapping[str, str],
    people: Mapping[str, str],
    runtime: Runtime,
) -> dict[str, Any]:
    """The content of manners.json. If manners cannot be measured, `applies` is false and `reason` says why.

    motion: the captured stretches of all clips. splits: clip -> "train" or "held_out". people: clip -> person
    who walks in it.
    """
    names = [name for name in network.channels if channel(name).manner]
    if not names or network.skeleton is None:
        return {"applies": False, "reason": NO_MANNERS}
    windows: dict[str, list[MannerWindow]] = {name: [] for name in names}
    for stretch in motion:
        for name, channel_windows in windows.items():
            channel_windows += captured_windows(stretch, network, name)
    results = [measure_channel(network, name, windows[name], splits, people, runtime) for name in names]
    channels = [result for result in results if result]
    return {"applies": True, "channels": channels} if channels else {"applies": False, "reason": TOO_FEW}


def measure_channel(
    network: Network,
    name: str,
    windows: Sequence[MannerWindow],
    splits: Mapping[str, str],
    people: Mapping[str, str],
    runtime: Runtime,
) -> dict[str, Any] | None:
    """The result for the channel `name`; None if walks of training clips show fewer than two manners.

    windows: the captured windows of all clips. splits: clip -> "train" or "held_out". people: clip -> person
    who walks in it.
    """
    training = [w for w in windows if splits[w.clip] == "train"]
    learnt = sorted({w.manner for w in training} - {NONE})
    if len(learnt) < 2:
        return None
    captured = recognise_left_out(windows, people)
    recogniser = learn(feature_table(training), [w.manner for w in training], captured["shrinkage"])
    # The target speed at pace 1, cm a frame.
    speed = float(np.median([w.values["speed"] for w in training if w.manner == NONE] or [USUAL_SPEED])) / FPS
    # What is generated, as manner -> value: no manner, each manner at HALF, each at FULL, each pair at FULL.
    single = [{}, *({manner: value} for value in (HALF, FULL) for manner in learnt)]
    cases = [*single, *(dict.fromkeys(pair, FULL) for pair in combinations(learnt, 2))]
    walkers = [WalkerInputs({name: values}, speed * pace) for values in cases for pace in PACES]
    walks = generated_windows(network, walkers, name, runtime)
    paces = len(PACES)
    # The windows of each of the `cases`, at all PACES.
    by_case = [[w for walk in walks[i : i + paces] for w in walk] for i in range(0, len(walks), paces)]
    # manner -> its windows at HALF, and at FULL. In `cases`, these follow the case without a manner.
    half, full = (dict(zip(learnt, by_case[1 + k * len(learnt) :], strict=False)) for k in (0, 1))
    rows = []
    for values, of_case in zip(cases, by_case, strict=True):
        value = next(iter(values.values()), 0.0) if len(values) < 2 else None
        named = _name_windows(recogniser, of_case, set(values) or {NONE})
        rows.append({"manners": list(values), "value": value, **named})
        if len(values) == 2:
            alone = (_mean_features(full[manner]) for manner in values)
            rows[-1]["between"] = _position_between(_mean_features(of_case), *alone)
    at_full = [row for row in rows if row["value"] == FULL]
    total = sum(row["windows"] for row in at_full)
    right = sum((row["share"] or 0.0) * row["windows"] for row in at_full)
    return {
        "channel": name,
        "title": channel(name).title,
        "manners": learnt,
        "speed_asked": round(speed * FPS / 100, 5),
        "captured": captured,
        "generated": rows,
        "right_at_1": round(right / total, 5) if total else None,
        "together": recognise_together(network, name, recogniser, learnt, speed, runtime),
        "effects": [
            {"channel": name, "manner": manner, "effect": effect}
            | _measure_effect(
                effect,
                [[w for w in training if w.manner == which] for which in (NONE, manner)],
                [by_case[0], half[manner], full[manner]],
            )
            for manner in learnt
            for effect in EFFECTS
        ],
    }


def recognise_together(
    network: Network,
    name: str,
    recogniser: Discriminant,
    learnt: Sequence[str],
    speed: float,
    runtime: Runtime,
) -> list[dict[str, Any]]:
    """How often each manner at 1 is recognised while a column of another channel is at its highest value.

    The result has a row for each pair of a manner (or NONE) and a column of another channel that was above 0
    in training. name: the channel of the manners. learnt: the manners that the recogniser knows. speed:
    target speed, cm a frame.
    """
    others = [
        (other, column)
        for other in network.channels
        if other != name
        for column in network.trained_labels(other)
    ]
    cases = [(manner, other, column) for manner in (NONE, *learnt) for other, column in others]
    if not cases:
        return []
    walkers = [
        WalkerInputs({name: {} if m == NONE else {m: FULL}, other: {column: channel(other).highest}}, speed)
        for m, other, column in cases
    ]
    walks = generated_windows(network, walkers, name, runtime)
    return [
        {"channel": name, "manner": manner, "other": other, "column": column}
        | _name_windows(recogniser, windows, {manner})
        for (manner, other, column), windows in zip(cases, walks, strict=True)
    ]


def run(inputs: MeasureInputs, options: SampleOptions) -> Outcome:
    """manners.json, and its lists `effects` and `together` as tables."""
    sample = sample_to_measure(inputs, options)
    motion = captured_motion(inputs.clips, sample)
    result = measure_manners(
        load_network(inputs.weights), motion, inputs.splits, inputs.people, inputs.runtime
    )
    channels = result.get("channels", [])
    effects, together = ([row for one in channels for row in one[key]] for key in ("effects", "together"))
    tables: dict[str, list[Row]] = {
        "effects": effects,
        "together": [{k: v for k, v in row.items() if k != "named"} for row in together],
    }
    log_line = "; ".join(f"{one['channel']}, share named right: {one['right_at_1']}" for one in channels)
    return Outcome(with_sample(result, sample), tables, log_line or result.get("reason", ""))


def _name_windows(
    recogniser: Discriminant, windows: Sequence[MannerWindow], right: set[str]
) -> dict[str, Any]:
    """The names that the recogniser gives to windows of generated walks, and the share of `right` ones."""
    names = recogniser.likeliest_classes(feature_table(windows))
    return {
        "windows": len(names),
        "share": share_of_true([name in right for name in names]),
        "named": {name: names.count(name) for name in sorted(set(names))},
    }


def _measure_effect(
    effect: str, captured: Sequence[Sequence[MannerWindow]], generated: Sequence[Sequence[MannerWindow]]
) -> dict[str, float | None]:
    """How much a manner changes the quantity `effect`.

    captured: windows of training clips without a manner, and with this manner. generated: windows without a
    manner, with this manner at .5, and with it at 1.
    """
    neutral, manner = captured
    plain, half, full = (mean_effect(windows, effect) for windows in generated)
    change = mean_effect(manner, effect) - mean_effect(neutral, effect) if neutral else None
    return {
        "captured": None if change is None else round(change, 4),
        "generated": round(full - plain, 4),
        "generated_at_half": round(half - plain, 4),
    }


def _position_between(pair: Array, first: Array, second: Array) -> float:
    """Where `pair` lies between `first` (0) and `second` (1), projected onto the line through these two.

    All are (D,) mean features of walks.
    """
    line = second - first
    return round(float((pair - first) @ line / max(float(line @ line), 1e-9)), 4)


def _mean_features(windows: Sequence[MannerWindow]) -> Array:
    """(D,) mean of each feature over the windows."""
    return np.asarray(feature_table(windows).mean(axis=0))
