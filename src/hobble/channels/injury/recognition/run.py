"""Measures whether a classifier that learnt from captured motion recognises the hurt part of generated walks.

A window is one second of a walk. A link is a pair of neighbouring joints. The classifier learns from windows
of the training clips and from the links that hurt in each window. Its accuracy on other captured windows is
the most that can be expected on generated windows. Its accuracy on generated walks is compared with the
accuracy of people who saw animated figures (Ferre 2019).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import cast

import numpy as np

from hobble.channels.injury.crowd_severities import injury_links, severity_inputs
from hobble.channels.injury.limp.captured_limps import HURT_VERSION
from hobble.channels.injury.recognition.results import RecognisedWindows, Recognition
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait.recognise import Discriminant, learn
from hobble.hurt.effects import part_of_link
from hobble.measures.measure import MeasureInputs, Outcome, Row, SampleOptions
from hobble.measures.sample import captured_motion, sample_to_measure, with_sample
from hobble.measures.walks import FPS, CrowdTarget, gait_features, generate_walks
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.captured import Captured
from hobble.runtime.options import Runtime

INJURY = "injury"  # name of the channel
HEALTHY = "healthy"  # the class of windows in which no link hurts
WINDOW = 60  # frames, about a cycle; windows of 75 or 90 are recognised less well
STEP = 15  # frames from the start of one window to the start of the next
# A stretch (consecutive frames of a clip) has four quarters. The cross-validation leaves out each in turn.
FOLDS = 4
SEVERITIES = (3.0, 5.0, 7.0, 10.0)  # of the links that hurt in generated walks
SPEEDS = (1.8, 2.2, 2.6)  # target speeds of the generated walks, cm a frame
WARM_UP = 4 * FPS  # frames at the beginning of a generated walk that are not used
USED = 6 * FPS  # frames after WARM_UP, which are used
AHEAD = 0.9  # a window counts as walking ahead only if at least this share of the root's speed is forward
LEAST_SPEED = 0.5  # cm a frame; a slower window does not count as walking
# A function that maps a class to the parts of the body that hurt, without their side (`parts_of_classes`)
PartsOfClass = Callable[[str], tuple[str, ...]]
NO_SEVERITIES = "this network has no severity inputs"
TOO_FEW = "the captured training clips have no walks, or only one kind (all healthy, or all hurt alike)"


@dataclass(frozen=True)
class InjuryWindow:
    """A window of a walk, WINDOW frames long.

    clip: name of the captured clip or generated walk. hurt: the window's class, which is HEALTHY or the names
    of the links that hurt, joined by " and ". severity: the highest severity in the window. values: name ->
    value of the features of `hobble.measures.walks.gait_features`. quarter: from 0 to 3, the quarter of a
    captured stretch in which the window lies; 0 in a generated walk.
    """

    clip: str
    hurt: str
    severity: float
    values: Mapping[str, float]
    quarter: int


def measure_recognition(
    network: Network,
    motion: Iterable[Captured],
    splits: Mapping[str, str],
    *,
    configuration: str,
    runtime: Runtime,
    people: float,
) -> Recognition:
    """The content of recognition.json, which says how well generated walks are recognised.

    The classifier learns from the captured training clips. The generated walks have the links of each class
    hurt, at severities 3, 5, 7 and 10. For the keys of the result see
    `hobble.channels.injury.recognition.results`. If the network or the clips do not allow the measurement,
    `applies` is false and `reason` says why.

    motion: stretches of the captured clips. splits: clip -> "train" or "held_out". people: share of hurt
    parts that people recognised in a published study.
    """
    not_measured: Recognition = {"configuration": configuration, "people": people, "applies": False}
    if not injury_links(network) or network.skeleton is None:
        return {**not_measured, "reason": NO_SEVERITIES}
    windows = [w for stretch in motion for w in walking_windows(stretch, network)]
    training = [w for w in windows if splits[w.clip] == "train"]
    classes = sorted({w.hurt for w in training})
    if len(classes) < 2:
        return {**not_measured, "reason": TOO_FEW}
    classifier = learn(feature_table(training), [w.hurt for w in training])
    parts_of_class = parts_of_classes(network.skeleton)
    generated = generated_windows(network, [c for c in classes if c != HEALTHY], HEALTHY in classes, runtime)
    return {
        "configuration": configuration,
        "people": people,
        "applies": True,
        "classes": classes,
        "features": list(training[0].values),
        "chance": round(1 / len(classes), 5),
        "captured": {
            "cross_validated": _cross_validate(training, parts_of_class),
            "held_out": _judge_windows(
                classifier, [w for w in windows if splits[w.clip] == "held_out"], parts_of_class
            ),
        },
        "generated": {
            **_judge_windows(classifier, generated, parts_of_class),
            "by_walk": _judge_walks(classifier, generated, parts_of_class),
        },
    }


def walking_windows(stretch: Captured, network: Network) -> list[InjuryWindow]:
    """The windows of a captured stretch in which the person walks ahead and the same links hurt throughout.

    A window lies completely in one quarter of the stretch.
    """
    assert network.skeleton is not None
    walk_share = stretch.gait[:, network.gaits.index("walk")]
    is_hurt = stretch.channels[INJURY] > 0  # (frames, links)
    out = []
    for quarter, start in product(range(FOLDS), range(0, len(stretch), STEP)):
        first = quarter * len(stretch) // FOLDS + start
        span = slice(first, first + WINDOW)
        if span.stop > (quarter + 1) * len(stretch) // FOLDS:
            continue
        speed = np.hypot(*stretch.velocity[span].mean(axis=0))
        walks_ahead = stretch.velocity[span, 1].mean() >= AHEAD * speed and speed >= LEAST_SPEED
        same_links = np.all(is_hurt[span] == is_hurt[first])
        if walk_share[span].mean() > 0.5 and walks_ahead and same_links:
            names = [injury_links(network)[i] for i in np.flatnonzero(is_hurt[first])]
            values = _features(network.skeleton, stretch.local, stretch.contacts, stretch.root, span)
            severity = float(stretch.channels[INJURY][span].max())
            out.append(InjuryWindow(stretch.clip, " and ".join(names) or HEALTHY, severity, values, quarter))
    return out


def generated_windows(
    network: Network, classes: Sequence[str], with_healthy: bool, runtime: Runtime
) -> list[InjuryWindow]:
    """Windows of generated walks, one walk for each class, severity and speed.

    classes: classes of hurt links, without HEALTHY. with_healthy: whether to add healthy walks.
    """
    assert network.skeleton is not None
    # (class, severity, target speed) of each walk
    cases = [(name, s, v) for name, s, v in product(classes, SEVERITIES, SPEEDS)]
    cases += [(HEALTHY, 0.0, v) for v in SPEEDS] if with_healthy else []
    injuries = [{} if name == HEALTHY else dict.fromkeys(name.split(" and "), s) for name, s, _ in cases]
    script = CrowdTarget(
        WARM_UP + USED, ["walk"] * len(cases), severity_inputs(network, injuries), [v for *_, v in cases]
    )
    walks = generate_walks(network, [script], runtime)
    out = []
    for i, (name, severity, speed) in enumerate(cases):
        for start in range(WARM_UP, WARM_UP + USED - WINDOW + 1, STEP):
            span = slice(start, start + WINDOW)
            values = _features(
                network.skeleton, walks.local[:, i], walks.contacts[:, i], walks.root[:, i], span
            )
            out.append(InjuryWindow(f"{name} {severity:g} {speed:g}", name, severity, values, 0))
    return out


def parts_of_classes(skeleton: Skeleton) -> PartsOfClass:
    """Returns a function that maps a class to the parts of the body that hurt, without left and right.

    The function maps the class "LeftLeg-LeftFoot" to ("shank",), and HEALTHY to ().
    """
    joints_of_link = dict(zip(skeleton.link_names, skeleton.links, strict=True))

    def parts(name: str) -> tuple[str, ...]:
        if name == HEALTHY:
            return ()
        return tuple(
            sorted({part_of_link(skeleton, joints_of_link[link]).name for link in name.split(" and ")})
        )

    return parts


def feature_table(windows: Sequence[InjuryWindow]) -> Array:
    """The D features of n windows, as an array (n, D)."""
    return np.array([list(w.values.values()) for w in windows])


def confusion_rows(result: Recognition) -> list[Row]:
    """The confusion tables by window, with a row for each cell.

    Columns: kind of motion, what hurts, what was recognised, number of windows.
    """
    if not result["applies"]:
        return []
    captured = result["captured"]
    tables: dict[str, RecognisedWindows] = {
        "cross_validated": captured["cross_validated"],
        "held_out": captured["held_out"],
        "generated": result["generated"],
    }
    return [
        {"motion": motion, "hurt": hurt, "named": named, "windows": count}
        for motion, found in tables.items()
        for hurt, row in found["confusion"].items()
        for named, count in row.items()
    ]


def run(inputs: MeasureInputs, options: SampleOptions) -> Outcome:
    """Measure the recognition. The outcome has the content of recognition.json and a table."""
    # Hurt versions are copies of healthy clips that were made limp by rules for each injury. They are left
    # out, because the classifier would learn these rules.
    clips = {clip: file for clip, file in inputs.clips.items() if not HURT_VERSION.search(clip)}
    summaries = [file for file in inputs.summaries if file.stem in clips]
    sample = sample_to_measure(replace(inputs, summaries=summaries), options)
    result = measure_recognition(
        load_network(inputs.weights),
        captured_motion(clips, sample),
        inputs.splits,
        configuration=inputs.configuration,
        runtime=inputs.runtime,
        people=inputs.published["recognition"]["share"],
    )
    right = (
        f"the hurt part is recognised in {result['generated']['right']} of the generated windows"
        if result["applies"]
        else ""
    )
    return Outcome(
        with_sample(result, sample), {"confusion": confusion_rows(result)}, right or result["reason"]
    )


def _features(
    skeleton: Skeleton, local: Array, contacts: Array, root: Array, span: slice
) -> dict[str, float]:
    """Name -> value of the features of the frames `span`. For the arrays see `Captured`."""
    return gait_features(skeleton, local[span], contacts[span], root[span])


def _cross_validate(windows: Sequence[InjuryWindow], parts_of_class: PartsOfClass) -> RecognisedWindows:
    """How windows are recognised if the classifier for each quarter learns from the other three quarters."""
    judged: list[InjuryWindow] = []
    named: list[str] = []
    for quarter in range(FOLDS):
        others = [w for w in windows if w.quarter != quarter]
        of_quarter = [w for w in windows if w.quarter == quarter]
        if of_quarter and len({w.hurt for w in others}) > 1:
            named += learn(feature_table(others), [w.hurt for w in others]).likeliest_classes(
                feature_table(of_quarter)
            )
            judged += of_quarter
    return _count_answers(sorted({w.hurt for w in windows}), judged, named, parts_of_class)


def _judge_windows(
    classifier: Discriminant, windows: Sequence[InjuryWindow], parts_of_class: PartsOfClass
) -> RecognisedWindows:
    """How the classifier recognises windows."""
    named = classifier.likeliest_classes(feature_table(windows)) if windows else []
    return _count_answers(classifier.classes, windows, named, parts_of_class)


def _judge_walks(
    classifier: Discriminant, windows: Sequence[InjuryWindow], parts_of_class: PartsOfClass
) -> RecognisedWindows:
    """How the classifier recognises whole walks. Its answer for a walk is the class with the highest score.

    A class's score for a walk is the sum of its scores for all windows of the walk.
    """
    scores = classifier.scores(feature_table(windows))  # (windows, classes)
    walks, named = [], []  # a window of each walk, the class that is recognised in the walk
    for walk in dict.fromkeys(w.clip for w in windows):
        of_walk = [i for i, w in enumerate(windows) if w.clip == walk]
        walks.append(windows[of_walk[0]])
        named.append(classifier.classes[int(np.argmax(scores[of_walk].sum(axis=0)))])
    return _count_answers(classifier.classes, walks, named, parts_of_class, "walks")


def _count_answers(
    classes: Sequence[str],
    windows: Sequence[InjuryWindow],
    named: Sequence[str],
    parts_of_class: PartsOfClass,
    counted: str = "windows",
) -> RecognisedWindows:
    """How windows were recognised.

    classes: all possible answers. named: the recognised class of each window. counted: "windows", or "walks"
    if each window stands for a whole walk.
    """
    confusion = {h: dict.fromkeys(classes, 0) for h in sorted({w.hurt for w in windows})}
    right: dict[float, list[bool]] = {}  # severity -> whether each answer is right
    for w, name in zip(windows, named, strict=True):
        confusion[w.hurt][name] += 1
        right.setdefault(w.severity, []).append(w.hurt == name)
    found = {
        counted: len(windows),
        "right": _share([is_right for of_severity in right.values() for is_right in of_severity]),
        "right_without_side": _share(
            [parts_of_class(w.hurt) == parts_of_class(name) for w, name in zip(windows, named, strict=True)]
        ),
        "by_severity": [
            {"severity": severity, counted: len(of_severity), "right": _share(of_severity)}
            for severity, of_severity in sorted(right.items())
        ],
        "confusion": confusion,
    }
    return cast(RecognisedWindows, found)


def _share(right: Sequence[bool]) -> float | None:
    """The share of the values that are True; None if there are no values."""
    return round(sum(right) / len(right), 5) if right else None
