"""Measures whether a recogniser that is trained on captured moods or diagnoses recognises the generated ones.

Also compares how much captured and generated manners change the walk, and measures whether a manner is still
recognised when another channel, such as injuries, has a value too.
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
from hobble.measures.clip_parts import captured_motion, sample_of, with_sample
from hobble.measures.inputs import MeasureInputs, Outcome, Row
from hobble.measures.manners.left_out import left_out, share
from hobble.measures.manners.results import ChannelResult, CombinedResult, Effect, Manners, NamedWindows
from hobble.measures.manners.windows import (
    EFFECTS,
    NONE,
    MannerWindow,
    WalkerInputs,
    captured_windows,
    generated,
    mean_effect,
    table,
)
from hobble.measures.sample_options import SampleOptions
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.options import Runtime

# Target speeds of generated walks, divided by the median speed of captured neutral walks. They are the same
# for every manner.
PACES = (0.85, 1.0, 1.15)
USUAL_SPEED = 120.0  # cm a second; stands for the median if there are no captured neutral walks
HALF, FULL = 0.5, 1.0  # values of a manner
NO_MANNERS = "none of this network's inputs is a manner of walking"
TOO_FEW = "there are walking clips of fewer than two manners"


def manners(
    network: Network,
    motion: Iterable[Captured],
    splits: Mapping[str, str],
    people: Mapping[str, str],
    runtime: Runtime,
) -> Manners:
    """The content of manners.json. If it cannot be measured, `applies` is false and `reason` says why.

    motion: the captured stretches of all clips. splits: clip -> "train" or "held_out". people: clip ->
    person.
    """
    names = [name for name in network.channels if channel(name).manner]
    if not names or network.skeleton is None:
        return {"applies": False, "reason": NO_MANNERS}
    windows: dict[str, list[MannerWindow]] = {name: [] for name in names}
    for clip in motion:
        for name, channel_windows in windows.items():
            channel_windows += captured_windows(clip, network, name)
    results = [of_channel(network, name, windows[name], splits, people, runtime) for name in names]
    measured = [result for result in results if result]
    return {"applies": True, "channels": measured} if measured else {"applies": False, "reason": TOO_FEW}


def of_channel(
    network: Network,
    name: str,
    windows: Sequence[MannerWindow],
    splits: Mapping[str, str],
    people: Mapping[str, str],
    runtime: Runtime,
) -> ChannelResult | None:
    """The result for the channel `name`; None if there are training clips of fewer than two manners.

    windows: the captured windows of all clips. splits: clip -> "train" or "held_out". people: clip -> person.
    """
    training = [w for w in windows if splits[w.clip] == "train"]
    learnt = sorted({w.manner for w in training} - {NONE})
    if len(learnt) < 2:
        return None
    captured = left_out(windows, people)
    recogniser = learn(table(training), [w.manner for w in training], captured["shrinkage"])
    speed = float(np.median([w.values["speed"] for w in training if w.manner == NONE] or [USUAL_SPEED])) / FPS
    single = [{}, *({manner: value} for value in (HALF, FULL) for manner in learnt)]
    combined = [*single, *(dict.fromkeys(pair, FULL) for pair in combinations(learnt, 2))]
    walkers = [WalkerInputs({name: values}, speed * pace) for values in combined for pace in PACES]
    walks = generated(network, walkers, name, runtime)
    per = len(PACES)
    # The windows for each entry of `combined`, at all PACES.
    by_entry = [[w for walk in walks[i : i + per] for w in walk] for i in range(0, len(walks), per)]
    half, full = (dict(zip(learnt, by_entry[1 + k * len(learnt) :], strict=False)) for k in (0, 1))
    rows = [_named(recogniser, values, some) for values, some in zip(combined, by_entry, strict=True)]
    for row, values, some in zip(rows, combined, by_entry, strict=True):
        if len(values) == 2:
            row["between"] = _between(_mean(some), *(_mean(full[manner]) for manner in values))
    right = [(row["share"], row["windows"]) for row in rows if row["value"] == FULL]
    return {
        "channel": name,
        "title": channel(name).title,
        "manners": learnt,
        "speed_asked": round(speed * FPS / 100, 5),
        "captured": captured,
        "generated": rows,
        "right_at_1": _weighted(right),
        "together": together(network, name, recogniser, learnt, speed, runtime),
        "effects": [
            _effect(name, manner, effect, training, by_entry[0], half[manner], full[manner])
            for manner in learnt
            for effect in EFFECTS
        ],
    }


def together(
    network: Network,
    name: str,
    recogniser: Discriminant,
    learnt: Sequence[str],
    speed: float,
    runtime: Runtime,
) -> list[CombinedResult]:
    """How often each manner at 1 is recognised while a column of another channel is at its highest value.

    The result has a row for each manner (and NONE) and each such column that was above 0 in training. learnt:
    the manners that the recogniser knows. speed: target speed, cm a frame.
    """
    others = [
        (other, column) for other in network.channels if other != name for column in network.trained(other)
    ]
    cases = [(manner, other, column) for manner in (NONE, *learnt) for other, column in others]
    if not cases:
        return []
    walkers = [
        WalkerInputs({name: {} if m == NONE else {m: FULL}, other: {column: channel(other).highest}}, speed)
        for m, other, column in cases
    ]
    walks = generated(network, walkers, name, runtime)
    rows: list[CombinedResult] = []
    for (manner, other, column), some in zip(cases, walks, strict=True):
        names = recogniser.names(table(some))
        rows.append(
            {
                "channel": name,
                "manner": manner,
                "other": other,
                "column": column,
                "windows": len(names),
                "share": share([n == manner for n in names]),
                "named": _counts(names),
            }
        )
    return rows


def run(inputs: MeasureInputs, options: SampleOptions) -> Outcome:
    """manners.json, and two tables: `effects`, and `together` for walks with values of two channels."""
    sample = sample_of(inputs, options)
    motion = captured_motion(inputs.clips, sample)
    result = manners(load_network(inputs.weights), motion, inputs.splits, inputs.people, inputs.runtime)
    measured = result.get("channels", [])
    tables: dict[str, list[Row]] = {
        "effects": [row for one in measured for row in one["effects"]],
        "together": [
            {k: v for k, v in row.items() if k != "named"} for one in measured for row in one["together"]
        ],
    }
    says = "; ".join(f"{one['channel']} named right: {one['right_at_1']}" for one in measured)
    return Outcome(with_sample(result, sample), tables, says or result.get("reason", ""))


def _named(
    recogniser: Discriminant, values: Mapping[str, float], windows: Sequence[MannerWindow]
) -> NamedWindows:
    """The names that the recogniser gives to the windows of a walk. values: manner -> its value."""
    names = recogniser.names(table(windows))
    right_names = set(values) or {NONE}
    return {
        "manners": list(values),
        "value": next(iter(values.values()), 0.0) if len(values) < 2 else None,
        "windows": len(names),
        "share": share([name in right_names for name in names]),
        "named": _counts(names),
    }


def _counts(names: Sequence[str]) -> dict[str, int]:
    return {name: names.count(name) for name in sorted(set(names))}


def _effect(
    name: str,
    manner: str,
    effect: str,
    training: Sequence[MannerWindow],
    plain: Sequence[MannerWindow],
    half: Sequence[MannerWindow],
    full: Sequence[MannerWindow],
) -> Effect:
    """One effect of one manner.

    name: the channel. training: captured windows of training clips. plain, half, full: generated windows
    without the manner, with it at .5 and at 1.
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


def _between(both: Array, first: Array, second: Array) -> float:
    """Where `both` lies between `first` (0) and `second` (1). All are (D,) mean features of walks."""
    way = second - first
    return round(float((both - first) @ way / max(float(way @ way), 1e-9)), 4)


def _mean(windows: Sequence[MannerWindow]) -> Array:
    return np.asarray(table(windows).mean(axis=0))


def _weighted(shares: Sequence[tuple[float | None, int]]) -> float | None:
    whole = sum(windows for _, windows in shares)
    return round(sum((right or 0.0) * windows for right, windows in shares) / whole, 5) if whole else None
