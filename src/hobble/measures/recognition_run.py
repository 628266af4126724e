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
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait.recognise import Discriminant, learn
from hobble.hurt.effects import part_of_link
from hobble.measures.measure import MeasureInputs, Outcome, Row, SampleOptions
from hobble.measures.sample import HURT_VERSION, captured_motion, sample_to_measure, with_sample
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
from hobble.runtime.options import Runtime

INJURY = "injury"  # the channel
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
TOO_FEW = "the captured training clips have no walks, or only one kind (all healthy, or all hurt alike)"
# A function that maps a class to the parts of the body that hurt, without left and right.
PartsOfClass = Callable[[str], tuple[str, ...]]


@dataclass(frozen=True)
class InjuryWindow:
    """A window of a walk, WINDOW frames long.

    clip: name of the captured clip or generated walk. hurt: the window's class, which is HEALTHY or the names
    of the links that hurt, joined by " and ". severity: the highest severity in the window. values: name ->
    value of the `gait_features`. quarter: from 0 to 3, the quarter of a captured stretch in which the window
    lies; 0 in a generated walk.
    """

    clip: str
    hurt: str
    severity: float
    values: Mapping[str, float]
    quarter: int = 0


def measure_recognition(
    network: Network,
    motion: Iterable[Captured],
    splits: Mapping[str, str],
    *,
    configuration: str,
    runtime: Runtime,
    people: float,
) -> dict[str, Any]:
    """The content of recognition.json, which says how well generated walks are recognised.

    The classifier learns from the captured training clips. The generated walks have the links of each class
    hurt, at severities 3, 5, 7 and 10. If the clips do not allow the measurement, `applies` is false and
    `reason` says why. docs/artefacts.md explains the keys.

    motion: stretches of the captured clips. splits: clip -> "train" or "held_out". people: share of hurt
    parts that people recognised in a published study.
    """
    assert network.skeleton is not None
    head: dict[str, Any] = {"configuration": configuration, "people": people}
    windows = [w for stretch in motion for w in walking_windows(stretch, network)]
    training = [w for w in windows if splits[w.clip] == "train"]
    held_out = [w for w in windows if splits[w.clip] == "held_out"]
    classes = sorted({w.hurt for w in training})
    if len(classes) < 2:
        return {**head, "applies": False, "reason": TOO_FEW}
    classifier = learn(feature_table(training), [w.hurt for w in training])
    parts = parts_of_classes(network.skeleton)
    generated = generated_windows(network, [c for c in classes if c != HEALTHY], HEALTHY in classes, runtime)

    def judge(judged: Sequence[InjuryWindow]) -> dict[str, Any]:
        named = classifier.likeliest_classes(feature_table(judged)) if judged else []
        return count_answers(classes, judged, named, parts)

    return {
        **head,
        "applies": True,
        "classes": classes,
        "features": list(training[0].values),
        "chance": round(1 / len(classes), 5),
        "captured": {"cross_validated": _cross_validate(training, parts), "held_out": judge(held_out)},
        "generated": {**judge(generated), "by_walk": _judge_walks(classifier, generated, parts)},
    }


def walking_windows(stretch: Captured, network: Network) -> list[InjuryWindow]:
    """The windows of a captured stretch in which the person walks ahead and the same links hurt throughout.

    A window lies completely in one quarter of the stretch.
    """
    assert network.skeleton is not None
    walk_share = stretch.gait[:, network.gaits.index("walk")]
    severities = stretch.channels[INJURY]  # (frames, links)
    out = []
    for quarter, start in product(range(FOLDS), range(0, len(stretch), STEP)):
        first = quarter * len(stretch) // FOLDS + start
        span = slice(first, first + WINDOW)
        if span.stop > (quarter + 1) * len(stretch) // FOLDS:
            continue
        speed = np.hypot(*stretch.velocity[span].mean(axis=0))
        walks_ahead = stretch.velocity[span, 1].mean() >= AHEAD * speed and speed >= LEAST_SPEED
        same_links = np.all((severities[span] > 0) == (severities[first] > 0))
        if walk_share[span].mean() > 0.5 and walks_ahead and same_links:
            names = [network.channels[INJURY][i] for i in np.flatnonzero(severities[first] > 0)]
            motion = (a[span] for a in (stretch.local, stretch.contacts, stretch.root))
            values = gait_features(network.skeleton, *motion)
            severity = float(severities[span].max())
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
    cases = list(product(classes, SEVERITIES, SPEEDS))
    cases += [(HEALTHY, 0.0, v) for v in SPEEDS] if with_healthy else []
    injuries = [{} if name == HEALTHY else dict.fromkeys(name.split(" and "), s) for name, s, _ in cases]
    hurt = channel_values(network, INJURY, injuries)
    target = CrowdTarget(WARM_UP + USED, ["walk"] * len(cases), hurt, [v for *_, v in cases])
    walks = generate_walks(network, [target], runtime)
    out = []
    for i, (name, severity, speed) in enumerate(cases):
        for start in range(WARM_UP, WARM_UP + USED - WINDOW + 1, STEP):
            span = slice(start, start + WINDOW)
            motion = (a[span, i] for a in (walks.local, walks.contacts, walks.root))
            values = gait_features(network.skeleton, *motion)
            out.append(InjuryWindow(f"{name} {severity:g} {speed:g}", name, severity, values))
    return out


def parts_of_classes(skeleton: Skeleton) -> PartsOfClass:
    """The function that maps the class "LeftLeg-LeftFoot" to ("shank",), and HEALTHY to ()."""
    joints_of_link = dict(zip(skeleton.link_names, skeleton.links, strict=True))

    def parts(name: str) -> tuple[str, ...]:
        links = () if name == HEALTHY else name.split(" and ")
        return tuple(sorted({part_of_link(skeleton, joints_of_link[link]).name for link in links}))

    return parts


def feature_table(windows: Sequence[InjuryWindow]) -> Array:
    """The D features of n windows, as an array (n, D)."""
    return np.array([list(w.values.values()) for w in windows])


def _cross_validate(windows: Sequence[InjuryWindow], parts: PartsOfClass) -> dict[str, Any]:
    """How windows are recognised if the classifier for each quarter learns from the other three quarters."""
    judged: list[InjuryWindow] = []
    named: list[str] = []
    for quarter in range(FOLDS):
        others = [w for w in windows if w.quarter != quarter]
        of_quarter = [w for w in windows if w.quarter == quarter]
        if of_quarter and len({w.hurt for w in others}) > 1:
            classifier = learn(feature_table(others), [w.hurt for w in others])
            named += classifier.likeliest_classes(feature_table(of_quarter))
            judged += of_quarter
    return count_answers(sorted({w.hurt for w in windows}), judged, named, parts)


def _judge_walks(
    classifier: Discriminant, windows: Sequence[InjuryWindow], parts: PartsOfClass
) -> dict[str, Any]:
    """How whole walks are recognised: as the class with the highest sum of scores of the windows."""
    scores = classifier.scores(feature_table(windows))  # (windows, classes)
    of_walk: dict[str, list[int]] = {}  # name of a walk -> its windows
    for i, window in enumerate(windows):
        of_walk.setdefault(window.clip, []).append(i)
    named = [classifier.classes[int(np.argmax(scores[which].sum(axis=0)))] for which in of_walk.values()]
    first = [windows[which[0]] for which in of_walk.values()]
    return count_answers(classifier.classes, first, named, parts, "walks")


def count_answers(
    classes: Sequence[str],
    windows: Sequence[InjuryWindow],
    named: Sequence[str],
    parts: PartsOfClass,
    counted: str = "windows",
) -> dict[str, Any]:
    """How windows were recognised.

    classes: all possible answers. named: the recognised class of each window. counted: "windows", or "walks"
    if each window stands for a whole walk.
    """
    confusion = {h: dict.fromkeys(classes, 0) for h in sorted({w.hurt for w in windows})}
    right: dict[float, list[bool]] = {}  # severity -> whether each answer is right
    for w, name in zip(windows, named, strict=True):
        confusion[w.hurt][name] += 1
        right.setdefault(w.severity, []).append(w.hurt == name)
    return {
        counted: len(windows),
        "right": share_of_true([is_right for of_severity in right.values() for is_right in of_severity]),
        "right_without_side": share_of_true(
            [parts(w.hurt) == parts(name) for w, name in zip(windows, named, strict=True)]
        ),
        "by_severity": [
            {"severity": severity, counted: len(of_severity), "right": share_of_true(of_severity)}
            for severity, of_severity in sorted(right.items())
        ],
        "confusion": confusion,
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
    log_line = str(result.get("reason", ""))
    if result["applies"]:
        share = result["generated"]["right"]
        log_line = f"the hurt part is recognised in {share} of the generated windows"
    return Outcome(with_sample(result, sample), {"confusion": confusion_rows(result)}, log_line)
