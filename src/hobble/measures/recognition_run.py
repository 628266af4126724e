"""Measures whether a classifier that learnt from captured motion recognises the hurt part of generated walks.

A window is one second of a walk. A link is a pair of neighbouring joints. The classifier learns from windows
of the training clips and from the links that hurt in each window. Its accuracy on other captured windows is
the most that can be expected on generated windows. Its accuracy on generated walks is compared with the
accuracy of people who saw animated figures (Ferre 2019).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pandas

from hobble.core.skeleton import Skeleton
from hobble.gait.recognise import Discriminant
from hobble.hurt.effects import part_of_link
from hobble.measures.measure import MeasureInputs, Outcome, Row, SampleOptions
from hobble.measures.sample import HURT_VERSION, captured_motion, sample_to_measure, with_sample
from hobble.measures.walks import share_of_true
from hobble.measures.windows import (
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

INJURY = "injury"  # the channel
HEALTHY = "healthy"  # the label of windows in which no link hurts; others name the links, joined by " and "
# A stretch (consecutive frames of a clip) has four quarters. The cross-validation leaves out each in turn.
FOLDS = 4
SEVERITIES = (3.0, 5.0, 7.0, 10.0)  # of the links that hurt in generated walks
SPEEDS = (1.8, 2.2, 2.6)  # target speeds of the generated walks, cm a frame
TOO_FEW = "the captured training clips have no walks, or only one kind (all healthy, or all hurt alike)"
# A function that maps a class to the parts of the body that hurt, without left and right.
PartsOfClass = Callable[[str], tuple[str, ...]]


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
    classes = sorted({w.label for w in training})
    if len(classes) < 2:
        return {**head, "applies": False, "reason": TOO_FEW}
    classifier = learn_windows(training)
    parts = parts_of_classes(network.skeleton)
    generated = generated_windows(network, [c for c in classes if c != HEALTHY], HEALTHY in classes, runtime)

    def judge(judged: Sequence[Window]) -> dict[str, Any]:
        table = feature_table([w.values for w in judged])
        return count_answers(classes, judged, classifier.likeliest_classes(table) if judged else [], parts)

    return {
        **head,
        "applies": True,
        "classes": classes,
        "features": list(training[0].values),
        "chance": round(1 / len(classes), 5),
        # The classifier for each quarter learns from the other three quarters.
        "captured": {
            "cross_validated": count_answers(
                classes, training, named_left_out(training, [w.part for w in training]), parts
            ),
            "held_out": judge(held_out),
        },
        "generated": {
            **judge(generated),
            "by_walk": count_answers(classes, *_whole_walks(classifier, generated), parts, "walks"),
        },
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


def _whole_walks(classifier: Discriminant, windows: Sequence[Window]) -> tuple[list[Window], list[str]]:
    """The first window of each walk, and the class with the highest sum of scores of the walk's windows."""
    scores = pandas.DataFrame(classifier.scores(feature_table([w.values for w in windows])))
    of_walks = scores.groupby([w.clip for w in windows], sort=False).sum()
    first = {w.clip: w for w in windows[::-1]}
    return [first[walk] for walk in of_walks.index], [classifier.classes[i] for i in of_walks.idxmax(axis=1)]


def count_answers(
    classes: Sequence[str],
    windows: Sequence[Window],
    named: Sequence[str] | np.ndarray,
    parts: PartsOfClass,
    counted: str = "windows",
) -> dict[str, Any]:
    """How windows were recognised.

    classes: all possible answers. named: the recognised class of each window; "" if it has no answer.
    counted: "windows", or "walks" if each window stands for a whole walk.
    """
    answers = pandas.DataFrame(
        {"hurt": [w.label for w in windows], "severity": [w.severity for w in windows], "named": list(named)}
    )
    answers = answers[answers.named != ""]
    answers["right"] = answers.hurt == answers.named
    confusion = pandas.crosstab(answers.hurt, answers.named).reindex(columns=list(classes), fill_value=0)
    return {
        counted: len(answers),
        "right": share_of_true(answers.right),
        "right_without_side": share_of_true(answers.hurt.map(parts) == answers.named.map(parts)),
        "by_severity": [
            {"severity": severity, counted: len(right), "right": share_of_true(right)}
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
