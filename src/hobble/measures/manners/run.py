"""Measures whether a recogniser that is trained on captured moods or diagnoses recognises the generated ones.

A mood or diagnosis is called a manner. The measurement also compares how much captured and generated manners
change the walk. And it measures whether a manner is still recognised when another channel, such as injuries,
has a value too.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations

import numpy as np

from hobble.channels import channel
from hobble.core.quat import Array
from hobble.evaluation.captured import Captured
from hobble.evaluation.crowd import FPS
from hobble.gait.discriminant import Discriminant, learn
from hobble.measures.clip_parts import captured_motion, sample_to_measure, with_sample
from hobble.measures.inputs import MeasureInputs, Outcome, Row
from hobble.measures.manners.left_out import recognise_left_out, share_of_true
from hobble.measures.manners.results import ChannelResult, CombinedResult, Effect, Manners, NamedWindows
from hobble.measures.manners.windows import (
    EFFECTS,
    NONE,
    MannerWindow,
    WalkerInputs,
    captured_windows,
    feature_table,
    generated_windows,
    mean_effect,
)
from hobble.measures.sample_options import SampleOptions
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.options import Runtime

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
) -> Manners:
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
) -> ChannelResult | None:
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
    rows = [
        _name_windows(recogniser, values, of_case) for values, of_case in zip(cases, by_case, strict=True)
    ]
    for row, values, of_case in zip(rows, cases, by_case, strict=True):
        if len(values) == 2:
            alone = (_mean_features(full[manner]) for manner in values)
            row["between"] = _position_between(_mean_features(of_case), *alone)
    at_full = [(row["share"], row["windows"]) for row in rows if row["value"] == FULL]
    return {
        "channel": name,
        "title": channel(name).title,
        "manners": learnt,
        "speed_asked": round(speed * FPS / 100, 5),
        "captured": captured,
        "generated": rows,
        "right_at_1": _mean_share(at_full),
        "together": recognise_together(network, name, recogniser, learnt, speed, runtime),
        "effects": [
            _measure_effect(name, manner, effect, training, by_case[0], half[manner], full[manner])
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
) -> list[CombinedResult]:
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
    rows: list[CombinedResult] = []
    for (manner, other, column), windows in zip(cases, walks, strict=True):
        names = recogniser.likeliest_classes(feature_table(windows))
        rows.append(
            {
                "channel": name,
                "manner": manner,
                "other": other,
                "column": column,
                "windows": len(names),
                "share": share_of_true([n == manner for n in names]),
                "named": _counts(names),
            }
        )
    return rows


def run(inputs: MeasureInputs, options: SampleOptions) -> Outcome:
    """manners.json, and its lists `effects` and `together` as tables."""
    sample = sample_to_measure(inputs, options)
    motion = captured_motion(inputs.clips, sample)
    result = measure_manners(
        load_network(inputs.weights), motion, inputs.splits, inputs.people, inputs.runtime
    )
    channels = result.get("channels", [])
    tables: dict[str, list[Row]] = {
        "effects": [row for of_channel in channels for row in of_channel["effects"]],
        "together": [
            {k: v for k, v in row.items() if k != "named"}
            for of_channel in channels
            for row in of_channel["together"]
        ],
    }
    log_line = "; ".join(f"{one['channel']}, share named right: {one['right_at_1']}" for one in channels)
    return Outcome(with_sample(result, sample), tables, log_line or result.get("reason", ""))


def _name_windows(
    recogniser: Discriminant, values: Mapping[str, float], windows: Sequence[MannerWindow]
) -> NamedWindows:
    """The names that the recogniser gives to windows of generated walks. values: manner -> its value."""
    names = recogniser.likeliest_classes(feature_table(windows))
    right_names = set(values) or {NONE}
    return {
        "manners": list(values),
        "value": next(iter(values.values()), 0.0) if len(values) < 2 else None,
        "windows": len(names),
        "share": share_of_true([name in right_names for name in names]),
        "named": _counts(names),
    }


def _counts(names: Sequence[str]) -> dict[str, int]:
    """Name -> how often it occurs."""
    return {name: names.count(name) for name in sorted(set(names))}


def _measure_effect(
    name: str,
    manner: str,
    effect: str,
    training: Sequence[MannerWindow],
    plain: Sequence[MannerWindow],
    half: Sequence[MannerWindow],
    full: Sequence[MannerWindow],
) -> Effect:
    """How much a manner changes the quantity `effect`.

    name: the channel. training: captured windows of training clips. plain, half, full: windows generated
    without a manner, with this manner at .5, and with it at 1.
    """
    neutral = [w for w in training if w.manner == NONE]
    captured = [w for w in training if w.manner == manner]
    base = mean_effect(plain, effect)
    return {
        "channel": name,
        "manner": manner,
        "effect": effect,
        "captured": round(mean_effect(captured, effect) - mean_effect(neutral, effect), 4)
        if neutral
        else None,
        "generated": round(mean_effect(full, effect) - base, 4),
        "generated_at_half": round(mean_effect(half, effect) - base, 4),
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


def _mean_share(shares: Sequence[tuple[float | None, int]]) -> float | None:
    """The mean of shares, weighted by numbers of windows; None without windows. shares: (share, windows)."""
    total = sum(windows for _, windows in shares)
    return round(sum((right or 0.0) * windows for right, windows in shares) / total, 5) if total else None
