"""Measures whether a recogniser that learnt from captured motion names what generated walks were asked for.

It names the links that hurt (a link is a pair of neighbouring joints), and moods and diagnoses, which are
called manners. It judges windows, stretches of straight walking of one second, from captured clips and from
generated walks. Its accuracy on captured windows from which it did not learn is the most that can be expected
on generated windows. For hurt links, it is compared with the accuracy of people who saw animated figures
(Ferre 2019).
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, product
from typing import Any

import numpy as np
import pandas

from hobble.channels import channel
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait.recognise import SHRINKAGE, Discriminant, learn
from hobble.hurt.effects import part_of_link
from hobble.measures.measure import MeasureInputs, Outcome, Row, SampleOptions
from hobble.measures.sample import HURT_VERSION, captured_motion, sample_to_measure, with_sample
from hobble.measures.walks import FPS, Case, CrowdTarget, gait_features, generate_walks, share_of_true
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.clip_rows import Captured
from hobble.rows.layout import GAITS
from hobble.runtime import Runtime

WINDOW, STEP = 60, 15  # frames: length of a window (about a cycle), and from one start to the next
AHEAD = 0.9  # a window is straight if at least this share of its mean velocity points forward
LEAST_SPEED = 0.5  # cm a frame; a slower window does not count as walking
WARM_UP, USED = 4 * FPS, 6 * FPS  # frames skipped at the start of a generated walk, and frames used
INJURY = "injury"  # the channel of hurt links
HEALTHY = "healthy"  # the label of windows in which no link hurts; others name the links, joined by " and "
# A stretch (consecutive frames of a clip) has four quarters. The cross-validation leaves out each in turn.
FOLDS = 4
SEVERITIES = (3.0, 5.0, 7.0, 10.0)  # of the links that hurt in generated walks
SPEEDS = (1.8, 2.2, 2.6)  # target speeds of the generated walks, cm a frame
NONE = "none"  # the manner of a clip whose values are all 0
# The recogniser of manners shrinks the covariance of the features towards its diagonal by one of these shares
# (0 to 1). All are tried. A large share is better if there are few clips: .6 recognises 69 % of moods (few
# clips) and 51 % of diagnoses (many clips); .02 recognises 54 % of moods and 63 % of diagnoses.
SHRINKAGES = (0.02, 0.1, 0.3, 0.6)
# Target speeds of walks with manners, divided by the median speed of captured neutral walks. They are the
# same for every manner.
PACES = (0.85, 1.0, 1.15)
USUAL_SPEED = 120.0  # cm a second; used instead of this median if there are no captured neutral walks
HALF, FULL = 0.5, 1.0  # values of a manner
NO_INJURIES = "none of this network's inputs is a severity"
TOO_FEW = "the captured training clips have no walks, or only one kind (all healthy, or all hurt alike)"
Values = Mapping[str, float]  # feature -> value
# A function of the type of `gait_features`.
Features = Callable[..., dict[str, float]]
# What a generated walk is asked for: the values of its channels, and speed, cm a frame.
Asked = tuple[Case, float]
# A function that maps a class to the parts of the body that hurt, without left and right.
PartsOfClass = Callable[[str], tuple[str, ...]]
# Quantities that are compared between walks with and without a manner, from mean features: m/s, cm, degrees
# forward, standard deviation of the arms' swing in degrees, degrees forward.
EFFECTS: Mapping[str, Callable[[Values], float]] = {
    "speed": lambda values: values["speed"] / 100,
    "stride": lambda values: values["step_left"] + values["step_right"],
    "trunk": lambda values: -values["trunk_forward_mean"],  # the feature has the direction down the trunk
    "arms": lambda values: (values["upper_arm_left_sd"] + values["upper_arm_right_sd"]) / 2,
    "head": lambda values: values["head"],
}


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
    target = CrowdTarget(WARM_UP + USED, ["walk"] * len(walks), cases, [speed for _, speed in walks])
    found = generate_walks(network, [target], runtime)
    motion = (found.local, found.contacts, found.root)
    spans = [slice(first, first + WINDOW) for first in range(WARM_UP, WARM_UP + USED - WINDOW + 1, STEP)]
    return [
        [features(network.skeleton, *(a[span, i] for a in motion)) for span in spans]
        for i in range(len(walks))
    ]


def manner_features(skeleton: Skeleton, local: Array, contacts: Array, root: Array) -> dict[str, float]:
    """The `gait_features`, and how far the head leans forward, in degrees."""
    head, neck = (local[:, skeleton.role(part)].astype(float) for part in ("head", "neck"))
    up = (head - neck).mean(axis=0)  # from the neck to the head
    lean = float(np.degrees(np.arctan2(up[2], up[1])))
    return {**gait_features(skeleton, local, contacts, root), "head": lean}


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


def measure_injuries(
    network: Network,
    motion: Iterable[Captured],
    splits: Mapping[str, str],
    *,
    runtime: Runtime,
    people: float,
) -> dict[str, Any]:
    """How well the links that hurt in generated walks are recognised: a part of recognition.json.

    The recogniser learns from the captured training clips. The generated walks have the links of each class
    hurt, at each of SEVERITIES. If the clips do not allow the measurement, `applies` is false and `reason`
    says why. docs/artefacts.md explains the keys.

    motion: stretches of the captured clips. splits: clip -> "train" or "held_out". people: share of hurt
    parts that people recognised in a published study.
    """
    assert network.skeleton is not None
    windows = [w for stretch in motion for w in walking_windows(stretch, network)]
    training = [w for w in windows if splits[w.clip] == "train"]
    classes = sorted({w.label for w in training})
    if len(classes) < 2:
        return {"people": people, "applies": False, "reason": TOO_FEW}
    recogniser, parts = learn_windows(training), parts_of_classes(network.skeleton)

    def judge(judged: Sequence[Window]) -> dict[str, Any]:
        table = feature_table([w.values for w in judged])
        return count_answers(classes, judged, recogniser.likeliest_classes(table) if judged else [], parts)

    # The recogniser for each quarter learns from the other three quarters.
    crossed = named_left_out(training, [w.part for w in training])
    hurt = [name for name in classes if name != HEALTHY]
    return {
        "people": people,
        "applies": True,
        "classes": classes,
        "features": list(training[0].values),
        "chance": round(1 / len(classes), 5),
        "captured": {
            "cross_validated": count_answers(classes, training, crossed, parts),
            "held_out": judge([w for w in windows if splits[w.clip] == "held_out"]),
        },
        "generated": judge(generated_windows(network, hurt, HEALTHY in classes, runtime)),
    }


def walking_windows(stretch: Captured, network: Network) -> list[Window]:
    """The windows of a captured stretch in which the same links hurt throughout.

    A window lies completely in one quarter of the stretch.
    """
    severities = stretch.channels[INJURY]  # (frames, links)
    out = []
    for quarter in range(FOLDS):
        start, stop = (n * len(stretch) // FOLDS for n in (quarter, quarter + 1))
        for span in straight_windows(stretch, start, stop):
            hurts = severities[span] > 0
            if (hurts == hurts[0]).all():
                names = [network.channels[INJURY][i] for i in np.flatnonzero(hurts[0])]
                severity, values = float(severities[span].max()), captured_values(network, stretch, span)
                out.append(Window(stretch.clip, " and ".join(names) or HEALTHY, values, severity, quarter))
    return out


def generated_windows(
    network: Network, classes: Sequence[str], with_healthy: bool, runtime: Runtime
) -> list[Window]:
    """Windows of generated walks, one walk for each class, severity and speed.

    classes: classes of hurt links, without HEALTHY. with_healthy: whether to add healthy walks.
    """
    cases = list(product(classes, SEVERITIES, SPEEDS))
    cases += [(HEALTHY, 0.0, speed) for speed in SPEEDS] if with_healthy else []
    walks = [
        ({} if name == HEALTHY else {INJURY: dict.fromkeys(name.split(" and "), severity)}, speed)
        for name, severity, speed in cases
    ]
    return [
        Window(f"{name} {severity:g} {speed:g}", name, values, severity)
        for (name, severity, speed), of_walk in zip(
            cases, generated_values(network, walks, runtime), strict=True
        )
        for values in of_walk
    ]


def parts_of_classes(skeleton: Skeleton) -> PartsOfClass:
    """The function that maps the class "LeftLeg-LeftFoot" to ("shank",), and HEALTHY to ()."""
    joints_of_link = dict(zip(skeleton.link_names, skeleton.links, strict=True))

    def parts(name: str) -> tuple[str, ...]:
        links = () if name == HEALTHY else name.split(" and ")
        return tuple(sorted({part_of_link(skeleton, joints_of_link[link]).name for link in links}))

    return parts


def count_answers(
    classes: Sequence[str], windows: Sequence[Window], named: Sequence[str] | np.ndarray, parts: PartsOfClass
) -> dict[str, Any]:
    """How windows were recognised.

    classes: all possible answers. named: the recognised class of each window; "" if it has no answer.
    """
    answers = pandas.DataFrame(
        {"hurt": [w.label for w in windows], "severity": [w.severity for w in windows], "named": list(named)}
    )
    answers = answers[answers.named != ""]
    answers["right"] = answers.hurt == answers.named
    confusion = pandas.crosstab(answers.hurt, answers.named).reindex(columns=list(classes), fill_value=0)
    return {
        "windows": len(answers),
        "right": share_of_true(answers.right),
        "right_without_side": share_of_true(answers.hurt.map(parts) == answers.named.map(parts)),
        "by_severity": [
            {"severity": severity, "windows": len(right), "right": share_of_true(right)}
            for severity, right in answers.groupby("severity").right
        ],
        "confusion": confusion.to_dict("index"),
    }


def confusion_rows(result: Mapping[str, Any]) -> list[Row]:
    """The confusion tables by window, with a row for each cell. result: the content of recognition.json.

    Columns: kind of motion, what hurts, what was recognised, number of windows.
    """
    tables = {**result["captured"], "generated": result["generated"]} if result["applies"] else {}
    return [
        {"motion": motion, "hurt": hurt, "named": named, "windows": count}
        for motion, found in tables.items()
        for hurt, row in found["confusion"].items()
        for named, count in row.items()
    ]


def manner_windows(stretch: Captured, network: Network, name: str) -> list[Window]:
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


def measure_manners(
    network: Network,
    name: str,
    motion: Iterable[Captured],
    splits: Mapping[str, str],
    people: Mapping[str, str],
    runtime: Runtime,
) -> dict[str, Any] | None:
    """The result for the channel `name`; None if walks of training clips show fewer than two manners.

    motion: stretches of the captured clips. splits: clip -> "train" or "held_out". people: clip -> person who
    walks in it.
    """
    windows = [w for stretch in motion for w in manner_windows(stretch, network, name)]
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
    walks = iter(generated_values(network, asked, runtime, manner_features))
    # The windows of each of the `cases`, at all PACES.
    by_case = {case: [w for _ in PACES for w in next(walks)] for case in cases}
    rows = [
        {"manners": list(some), "value": value if len(some) < 2 else None}
        | _name_windows(recogniser, of_case, set(some) or {NONE})
        for (some, value), of_case in by_case.items()
    ]
    at_full = pandas.DataFrame([row for row in rows if row["value"] == FULL])
    return {
        "channel": name,
        "title": channel(name).title,
        "manners": learnt,
        "speed_asked": round(speed * FPS / 100, 5),
        "captured": captured,
        "generated": rows,
        "right_at_1": round(float(np.average(at_full.share, weights=at_full.windows)), 5),
        "effects": effects_of_manners(name, learnt, of_manner, by_case),
    }


def effects_of_manners(
    name: str,
    manners: Sequence[str],
    captured: Mapping[str, Sequence[Values]],
    generated: Mapping[tuple[tuple[str, ...], float], Sequence[Values]],
) -> list[dict[str, Any]]:
    """How much each manner changes each of EFFECTS, in captured walks and in generated ones.

    name: the channel. captured: manner -> its windows. generated: (manners, value) -> windows.
    """

    def change(size: Callable[[Values], float], manner: Sequence[Values], plain: Sequence[Values]) -> Any:
        """How much larger an effect is in windows with a manner than in plain ones, if there are some."""
        of_manner, of_plain = (pandas.DataFrame(list(values)).mean() for values in (manner, plain))
        return round(float(size(of_manner) - size(of_plain)), 4) if plain else None

    return [
        {
            "channel": name,
            "manner": manner,
            "effect": effect,
            "captured": change(size, captured[manner], captured[NONE]),
            "generated": change(size, generated[(manner,), FULL], generated[(), 0.0]),
            "generated_at_half": change(size, generated[(manner,), HALF], generated[(), 0.0]),
        }
        for manner in manners
        for effect, size in EFFECTS.items()
    ]


def _name_windows(recogniser: Discriminant, windows: Sequence[Values], right: set[str]) -> dict[str, Any]:
    """The names that the recogniser gives to windows of generated walks, and the share of `right` ones."""
    names = recogniser.likeliest_classes(feature_table(windows))
    return {
        "windows": len(names),
        "share": share_of_true([name in right for name in names]),
        "named": {name: names.count(name) for name in sorted(set(names))},
    }


def run(inputs: MeasureInputs, options: SampleOptions) -> Outcome:
    """recognition.json, and two tables: `confusion`, and `effects` of manners."""
    # Hurt versions are copies of healthy clips that were made limp by rules for each injury. They are left
    # out, because the recogniser would learn these rules.
    clips = {clip: file for clip, file in inputs.clips.items() if not HURT_VERSION.search(clip)}
    summaries = [file for file in inputs.summaries if file.stem in clips]
    sample = sample_to_measure(replace(inputs, summaries=summaries), options)
    network = load_network(inputs.weights)
    result: dict[str, Any] = {"applies": False, "reason": NO_INJURIES}
    if INJURY in network.channels:
        people = inputs.published["recognition"]["share"]
        motion = captured_motion(clips, sample)
        result = measure_injuries(network, motion, inputs.splits, runtime=inputs.runtime, people=people)
    channels = []
    for name in (name for name in network.channels if channel(name).manner):
        motion = captured_motion(clips, sample)
        found = measure_manners(network, name, motion, inputs.splits, inputs.people, inputs.runtime)
        channels += [found] if found else []
    result = {"configuration": inputs.configuration, **result, "channels": channels}
    effects: list[Row] = [row for one in channels for row in one["effects"]]
    shares = {one["channel"]: one["right_at_1"] for one in channels}
    if result["applies"]:
        shares[INJURY] = result["generated"]["right"]
    log_line = f"share of generated windows named right: {shares}" if shares else result["reason"]
    return Outcome(
        with_sample(result, sample), {"confusion": confusion_rows(result), "effects": effects}, log_line
    )
