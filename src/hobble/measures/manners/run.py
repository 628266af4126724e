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

PACES = (0.85, 1.0, 1.15)  # of the median speed of captured neutral walks; the same for every manner
ASKED = 120.0  # cm a second; target speed if there are no captured neutral walks
HALF, FULL = 0.5, 1.0  # values of a manner
REASON = "none of this network's inputs is a manner of walking"
TOO_FEW = "there are walking clips of fewer than two manners"


def manners(
    network: Network,
    motion: Iterable[Captured],
    splits: Mapping[str, str],
    people: Mapping[str, str],
    runtime: Runtime,
) -> Manners:
    """The content of manners.json. If it cannot be measured, `applies` is false and `reason` says why.

    people: clip -> the person who walks in it, or the clip's own name if the person is unknown. In the
    result, channels: a result for each channel of manners, see `of_channel`.
    """
    names = [name for name in network.channels if channel(name).manner]
    if not names or network.skeleton is None:
        return {"applies": False, "reason": REASON}
    windows: dict[str, list[MannerWindow]] = {name: [] for name in names}
    for clip in motion:
        for name, some in windows.items():
            some += captured_windows(clip, network, name)
    found = [of_channel(network, name, windows[name], splits, people, runtime) for name in names]
    measured = [one for one in found if one]
    return {"applies": True, "channels": measured} if measured else {"applies": False, "reason": TOO_FEW}


def of_channel(
    network: Network,
    name: str,
    windows: Sequence[MannerWindow],
    splits: Mapping[str, str],
    people: Mapping[str, str],
    runtime: Runtime,
) -> ChannelResult | None:
    """The result for one channel; None if there are walks of fewer than two manners.

    captured: recognition of captured people, see `left_out`. generated: for each manner and value, the share
    of windows that a recogniser trained on the training clips names right. For two manners at once, either
    name is right, and `between` says to which of the two the walk is closer. together: recognition of each
    manner at 1 while a column of another channel is at its highest value. effects: how much each manner
    changes the walk from neutral, captured and generated.
    """
    known = [w for w in windows if splits[w.clip] == "train"]
    found = sorted({w.manner for w in known} - {NONE})
    if len(found) < 2:
        return None
    captured = left_out(windows, people)
    judge = learn(table(known), [w.manner for w in known], captured["shrinkage"])
    speed = float(np.median([w.values["speed"] for w in known if w.manner == NONE] or [ASKED])) / FPS
    single = [{}, *({manner: value} for value in (HALF, FULL) for manner in found)]
    combined = [*single, *(dict.fromkeys(pair, FULL) for pair in combinations(found, 2))]
    figures = [WalkerInputs({name: values}, speed * pace) for values in combined for pace in PACES]
    walks = generated(network, figures, name, runtime)
    per = len(PACES)
    each = [[w for walk in walks[i : i + per] for w in walk] for i in range(0, len(walks), per)]
    half, full = (dict(zip(found, each[1 + k * len(found) :], strict=False)) for k in (0, 1))
    rows = [_named(judge, values, some) for values, some in zip(combined, each, strict=True)]
    for row, values, some in zip(rows, combined, each, strict=True):
        if len(values) == 2:
            row["between"] = _between(_mean(some), *(_mean(full[manner]) for manner in values))
    right = [(row["share"], row["windows"]) for row in rows if row["value"] == FULL]
    return {
        "channel": name,
        "title": channel(name).title,
        "manners": found,
        "speed_asked": round(speed * FPS / 100, 5),
        "captured": captured,
        "generated": rows,
        "right_at_1": _weighted(right),
        "together": together(network, name, judge, found, speed, runtime),
        "effects": [_effect(name, m, e, known, each[0], half[m], full[m]) for m in found for e in EFFECTS],
    }


def together(
    network: Network, name: str, judge: Discriminant, found: Sequence[str], speed: float, runtime: Runtime
) -> list[CombinedResult]:
    """How often each manner at 1 is named while a column of another channel is at its highest value.

    It has a row for each manner (or NONE) and each column that was above 0 in training.
    """
    others = [
        (other, column) for other in network.channels if other != name for column in network.trained(other)
    ]
    cases = [(manner, other, column) for manner in (NONE, *found) for other, column in others]
    if not cases:
        return []
    figures = [
        WalkerInputs({name: {} if m == NONE else {m: FULL}, other: {column: channel(other).highest}}, speed)
        for m, other, column in cases
    ]
    walks = generated(network, figures, name, runtime)
    rows: list[CombinedResult] = []
    for (manner, other, column), some in zip(cases, walks, strict=True):
        names = judge.names(table(some))
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
    found = result.get("channels", [])
    tables: dict[str, list[Row]] = {
        "effects": [row for one in found for row in one["effects"]],
        "together": [
            {k: v for k, v in row.items() if k != "named"} for one in found for row in one["together"]
        ],
    }
    says = "; ".join(f"{one['channel']} named right: {one['right_at_1']}" for one in found)
    return Outcome(with_sample(result, sample), tables, says or result.get("reason", ""))


def _named(judge: Discriminant, values: Mapping[str, float], windows: Sequence[MannerWindow]) -> NamedWindows:
    names = judge.names(table(windows))
    wanted = set(values) or {NONE}
    return {
        "manners": list(values),
        "value": next(iter(values.values()), 0.0) if len(values) < 2 else None,
        "windows": len(names),
        "share": share([name in wanted for name in names]),
        "named": _counts(names),
    }


def _counts(names: Sequence[str]) -> dict[str, int]:
    return {name: names.count(name) for name in sorted(set(names))}


def _effect(
    name: str,
    manner: str,
    effect: str,
    known: Sequence[MannerWindow],
    plain: Sequence[MannerWindow],
    half: Sequence[MannerWindow],
    full: Sequence[MannerWindow],
) -> Effect:
    """One effect of one manner.

    known: captured windows. plain, half, full: generated windows without the manner, with it at .5 and at 1.
    """
    neutral = [w for w in known if w.manner == NONE]
    mine = [w for w in known if w.manner == manner]
    base = mean_effect(plain, effect)
    return {
        "channel": name,
        "manner": manner,
        "effect": effect,
        "captured": round(mean_effect(mine, effect) - mean_effect(neutral, effect), 4) if neutral else None,
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
