"""Measures whether moods and diagnoses (manners) are recognised in generated walks.

The recogniser judges windows, stretches of straight walking of one second, from captured clips and from
generated walks.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pandas

from hobble.channels import channel
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait.recognise import Discriminant
from hobble.measures.measure import MeasureInputs, Outcome, Row, SampleOptions
from hobble.measures.sample import captured_motion, sample_to_measure, with_sample
from hobble.measures.walks import FPS, gait_features, share_of_true
from hobble.measures.windows import (
    Values,
    Window,
    captured_values,
    feature_table,
    generated_values,
    learn_windows,
    named_left_out,
    straight_windows,
)
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.clip_rows import Captured
from hobble.runtime.options import Runtime

NONE = "none"  # the manner of a clip whose values are all 0
# Quantities that are compared between walks with and without a manner, from mean features: m/s, cm, degrees
# forward, standard deviation of the arms' swing in degrees, degrees forward.
EFFECTS: Mapping[str, Callable[[Values], float]] = {
    "speed": lambda values: values["speed"] / 100,
    "stride": lambda values: values["step_left"] + values["step_right"],
    "trunk": lambda values: -values["trunk_forward_mean"],  # the feature has the direction down the trunk
    "arms": lambda values: (values["upper_arm_left_sd"] + values["upper_arm_right_sd"]) / 2,
    "head": lambda values: values["head"],
}


def manner_features(skeleton: Skeleton, local: Array, contacts: Array, root: Array) -> dict[str, float]:
    """The `gait_features`, and how far the head leans forward, in degrees."""
    head, neck = (local[:, skeleton.role(part)].astype(float) for part in ("head", "neck"))
    up = (head - neck).mean(axis=0)  # from the neck to the head
    lean = float(np.degrees(np.arctan2(up[2], up[1])))
    return {**gait_features(skeleton, local, contacts, root), "head": lean}


def captured_windows(stretch: Captured, network: Network, name: str) -> list[Window]:
    """The windows of straight walking in a captured stretch of a clip.

    In each window there is no manner, or one manner at its highest value, and all other channels are 0.
    name: the channel of the manners.
    """
    columns, highest = network.channels[name], channel(name).highest
    others = [values for other, values in stretch.channels.items() if other != name]
    out = []
    for span in straight_windows(stretch):
        values = stretch.channels[name][span.start]  # the same in all frames of a clip
        manners = [columns[i] for i in np.flatnonzero(values)]
        at_most_one = len(manners) < 2 and np.isin(values, (0, highest)).all()
        if at_most_one and not any(np.any(other[span]) for other in others):
            features = captured_values(network, stretch, span, manner_features)
            out.append(Window(stretch.clip, manners[0] if manners else NONE, features))
    return out


# The recogniser shrinks the covariance of the features towards its diagonal by one of these shares (0 to 1).
# All are tried. A large share is better if there are few clips: .6 recognises 69 % of moods (few clips) and
# 51 % of diagnoses (many clips); .02 recognises 54 % of moods and 63 % of diagnoses.
SHRINKAGES = (0.02, 0.1, 0.3, 0.6)


def recognise_left_out(
    windows: Sequence[Window], people: Mapping[str, str], shrinkages: Sequence[float] = SHRINKAGES
) -> dict[str, Any]:
    """Recognise the manner in each person's windows after learning from the windows of all other people.

    people: clip -> person. shrinkages: the shares to try, see SHRINKAGES. The result is for the shrinkage
    with which most windows are named right. If several are equally good, it is for the largest of them. A
    manner that only one person has is never recognised, because it cannot be learnt while this person is left
    out.
    """
    frame = pandas.DataFrame(
        {"manner": [w.label for w in windows], "person": [people[w.clip] for w in windows]}
    )
    named = {each: named_left_out(windows, frame["person"].tolist(), each) for each in shrinkages}

    def right(each: float) -> float:
        return share_of_true((named[each] == frame.manner)[named[each] != ""]) or 0.0

    best = max(shrinkages, key=lambda each: (right(each), each))
    frame["right"] = named[best] == frame.manner
    frame["presence_right"] = (named[best] == NONE) == (frame.manner == NONE)
    tried = frame[named[best] != ""]
    return {
        "shrinkage": best,
        "people": frame.person.nunique(),
        "people_of": frame.groupby("manner").person.nunique().to_dict(),
        "windows": len(tried),
        "right": share_of_true(tried.right),
        "by_manner": {manner: share_of_true(right) for manner, right in tried.groupby("manner").right},
        "presence_right": share_of_true(tried.presence_right),
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
    windows: dict[str, list[Window]] = {name: [] for name in names}
    for stretch in motion:
        for name, channel_windows in windows.items():
            channel_windows += captured_windows(stretch, network, name)
    results = [measure_channel(network, name, windows[name], splits, people, runtime) for name in names]
    channels = [result for result in results if result]
    return {"applies": True, "channels": channels} if channels else {"applies": False, "reason": TOO_FEW}


def measure_channel(
    network: Network,
    name: str,
    windows: Sequence[Window],
    splits: Mapping[str, str],
    people: Mapping[str, str],
    runtime: Runtime,
) -> dict[str, Any] | None:
    """The result for the channel `name`; None if walks of training clips show fewer than two manners.

    windows: the captured windows of all clips. splits: clip -> "train" or "held_out". people: clip -> person
    who walks in it.
    """
    training = [w for w in windows if splits[w.clip] == "train"]
    learnt = sorted({w.label for w in training} - {NONE})
    if len(learnt) < 2:
        return None
    captured = recognise_left_out(windows, people)
    of_manner = {m: [w.values for w in training if w.label == m] for m in (NONE, *learnt)}
    recogniser = learn_windows(training, captured["shrinkage"])
    # The target speed at pace 1, cm a frame.
    speed = float(np.median([values["speed"] for values in of_manner[NONE]] or [USUAL_SPEED])) / FPS
    # What is generated, as manners and their value: none, each at HALF, each at FULL, each pair at FULL.
    cases: list[tuple[tuple[str, ...], float]] = [((), 0.0)]
    cases += [((manner,), value) for value in (HALF, FULL) for manner in learnt]
    cases += [(pair, FULL) for pair in combinations(learnt, 2)]
    asked = [({name: dict.fromkeys(some, value)}, speed * pace) for some, value in cases for pace in PACES]
    # Then each manner (or none) at FULL, while a column of another channel is at its highest value.
    others = [(n, column) for n in network.channels if n != name for column in network.trained_labels(n)]
    mixed = [(manner, other, column) for manner in (NONE, *learnt) for other, column in others]
    asked += [
        ({name: {m: FULL} if m != NONE else {}, other: {column: channel(other).highest}}, speed)
        for m, other, column in mixed
    ]
    walks = iter(generated_values(network, asked, runtime, manner_features))
    # The windows of each of the `cases`, at all PACES.
    by_case = {case: [w for _ in PACES for w in next(walks)] for case in cases}
    together = [
        {"channel": name, "manner": manner, "other": other, "column": column}
        | _name_windows(recogniser, next(walks), {manner})
        for manner, other, column in mixed
    ]
    means = {case: pandas.DataFrame(values).mean() for case, values in by_case.items()}
    captured_means = {m: pandas.DataFrame(values).mean() for m, values in of_manner.items() if values}
    rows = []
    for (some, value), of_case in by_case.items():
        named = _name_windows(recogniser, of_case, set(some) or {NONE})
        rows.append({"manners": list(some), "value": value if len(some) < 2 else None, **named})
        if len(some) == 2:
            rows[-1]["between"] = _position_between(*(means[m, FULL] for m in (some, some[:1], some[1:])))
    at_full = pandas.DataFrame([row for row in rows if row["value"] == FULL])
    return {
        "channel": name,
        "title": channel(name).title,
        "manners": learnt,
        "speed_asked": round(speed * FPS / 100, 5),
        "captured": captured,
        "generated": rows,
        "right_at_1": round(float(np.average(at_full.share, weights=at_full.windows)), 5),
        "together": together,
        "effects": [
            {
                "channel": name,
                "manner": manner,
                "effect": effect,
                "captured": _change(size, captured_means[manner], captured_means.get(NONE)),
                "generated": _change(size, means[(manner,), FULL], means[(), 0.0]),
                "generated_at_half": _change(size, means[(manner,), HALF], means[(), 0.0]),
            }
            for manner in learnt
            for effect, size in EFFECTS.items()
        ],
    }


def run(inputs: MeasureInputs, options: SampleOptions) -> Outcome:
    """manners.json, and its lists `effects` and `together` as tables."""
    sample = sample_to_measure(inputs, options)
    motion = captured_motion(inputs.clips, sample)
    result = measure_manners(
        load_network(inputs.weights), motion, inputs.splits, inputs.people, inputs.runtime
    )
    channels = result.get("channels", [])
    tables: dict[str, list[Row]] = {
        key: [{k: v for k, v in row.items() if k != "named"} for one in channels for row in one[key]]
        for key in ("effects", "together")
    }
    log_line = "; ".join(f"{one['channel']}, share named right: {one['right_at_1']}" for one in channels)
    return Outcome(with_sample(result, sample), tables, log_line or result.get("reason", ""))


def _name_windows(recogniser: Discriminant, windows: Sequence[Values], right: set[str]) -> dict[str, Any]:
    """The names that the recogniser gives to windows of generated walks, and the share of `right` ones."""
    names = recogniser.likeliest_classes(feature_table(windows))
    return {
        "windows": len(names),
        "share": share_of_true([name in right for name in names]),
        "named": {name: names.count(name) for name in sorted(set(names))},
    }


def _change(
    size: Callable[[Values], float], manner: pandas.Series, plain: pandas.Series | None
) -> float | None:
    """How much larger an effect is in walks with a manner than in plain walks. Both are mean features."""
    return None if plain is None else round(float(size(manner) - size(plain)), 4)


def _position_between(pair: pandas.Series, first: pandas.Series, second: pandas.Series) -> float:
    """Where `pair` lies between `first` (0) and `second` (1), projected onto the line through these two.

    All are mean features of walks.
    """
    line = second - first
    return round(float((pair - first) @ line / max(float(line @ line), 1e-9)), 4)
