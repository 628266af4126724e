"""Measures whether a classifier that learnt from captured motion recognises the hurt part of generated walks.

It learns from windows of the training clips and the link that hurts in each. Its accuracy on other captured
windows is the most that can be expected on generated ones. Its accuracy on generated walks is compared with
that of people who saw animated figures (Ferre 2019).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import cast

import numpy as np

from hobble.channels.injury.crowd_severities import links as links_of
from hobble.channels.injury.crowd_severities import severities
from hobble.channels.injury.limp.captured_limps import HURT_VERSION
from hobble.channels.injury.recognition.results import RecognisedWindows, Recognition
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.evaluation.captured import Captured
from hobble.evaluation.crowd import FPS, CrowdTarget
from hobble.evaluation.crowd import run as run_walks
from hobble.evaluation.gait_features import features
from hobble.gait.discriminant import Discriminant, learn
from hobble.hurt.body_parts import part_of_link
from hobble.measures.clip_parts import captured_motion, sample_of, with_sample
from hobble.measures.inputs import MeasureInputs, Outcome, Row
from hobble.measures.sample_options import SampleOptions
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.options import Runtime

INJURY = "injury"  # the channel
HEALTHY = "healthy"
WINDOW = 60  # frames, about a cycle; windows of 75 or 90 are recognised less well
STEP = 15  # frames from the start of one window to the start of the next
FOLDS = 4  # the cross-validation leaves out each quarter of a stretch (consecutive frames of a clip) in turn
SEVERITIES = (3.0, 5.0, 7.0, 10.0)  # of the generated walks
SPEEDS = (1.8, 2.2, 2.6)  # target speeds of the generated walks, cm a frame
WARM_UP = 4 * FPS  # frames at the beginning of a generated walk that are not used
USED = 6 * FPS  # the frames after them that are used
AHEAD = 0.9  # a window counts as walking only if at least this share of the root's speed is forward
LEAST_SPEED = 0.5  # cm a frame; a slower window does not count as walking
# A function that `parts_of_classes` returns: class -> parts of the body, without their side.
PartsOfClass = Callable[[str], tuple[str, ...]]
NO_SEVERITIES = "this network has no severity inputs"
TOO_FEW = "the captured training clips have no walks, or only one kind (all healthy, or all hurt alike)"


@dataclass(frozen=True)
class InjuryWindow:
    """A second of walking.

    clip: name of the captured clip or generated walk. hurt: the class: HEALTHY, or the links that hurt,
    joined by " and ". severity: the highest severity in the window. values: name -> value of the features of
    `hobble.evaluation.gait_features`. quarter: 0 to 3, the quarter of a captured stretch that the window is
    in, for the cross-validation.
    """

    clip: str
    hurt: str
    severity: float
    values: Mapping[str, float]
    quarter: int


def recognition(
    network: Network,
    motion: Iterable[Captured],
    splits: Mapping[str, str],
    *,
    configuration: str,
    runtime: Runtime,
    people: float,
) -> Recognition:
    """The content of recognition.json: how well generated walks are recognised.

    The classifier learns from the captured training clips.

    motion: the captured clips. splits: clip -> "train" or "held_out". people: share of hurt parts that people
    recognised in a published study.

    `classes`: what the classifier can recognise. `captured`: results on captured clips. `generated`: results
    on walks with the links of each class at severities 3, 5, 7 and 10. For their keys see
    `hobble.channels.injury.recognition.results`. If the network or the clips do not allow the measurement,
    `applies` is false and `reason` says why.
    """
    refused: Recognition = {"configuration": configuration, "people": people, "applies": False}
    if not links_of(network) or network.skeleton is None:
        return {**refused, "reason": NO_SEVERITIES}
    windows = [w for clip in motion for w in walking_windows(clip, network)]
    training = [w for w in windows if splits[w.clip] == "train"]
    classes = sorted({w.hurt for w in training})
    if len(classes) < 2:
        return {**refused, "reason": TOO_FEW}
    classifier = learn(table(training), [w.hurt for w in training])
    parts_of_class = parts_of_classes(network.skeleton)
    walks = generated(network, [c for c in classes if c != HEALTHY], HEALTHY in classes, runtime)
    return {
        "configuration": configuration,
        "people": people,
        "applies": True,
        "classes": classes,
        "features": list(training[0].values),
        "chance": round(1 / len(classes), 5),
        "captured": {
            "cross_validated": _cross_validated(training, parts_of_class),
            "held_out": _judged(
                classifier, [w for w in windows if splits[w.clip] == "held_out"], parts_of_class
            ),
        },
        "generated": {
            **_judged(classifier, walks, parts_of_class),
            "by_walk": _by_walk(classifier, walks, parts_of_class),
        },
    }


def walking_windows(clip: Captured, network: Network) -> list[InjuryWindow]:
    """The windows of a captured stretch in which the person walks ahead and the same links hurt."""
    assert network.skeleton is not None
    walk = clip.gait[:, network.gaits.index("walk")]
    hurts = clip.channels[INJURY] > 0
    out = []
    for quarter, start in product(range(FOLDS), range(0, len(clip), STEP)):
        first = quarter * len(clip) // FOLDS + start
        span = slice(first, first + WINDOW)
        if span.stop > (quarter + 1) * len(clip) // FOLDS:
            continue
        speed = np.hypot(*clip.velocity[span].mean(axis=0))
        ahead = clip.velocity[span, 1].mean() >= AHEAD * speed and speed >= LEAST_SPEED
        same = np.all(hurts[span] == hurts[first])
        if walk[span].mean() > 0.5 and ahead and same:
            names = [links_of(network)[i] for i in np.flatnonzero(hurts[first])]
            values = _values(network.skeleton, clip.local, clip.contacts, clip.root, span)
            severity = float(clip.channels[INJURY][span].max())
            out.append(InjuryWindow(clip.clip, " and ".join(names) or HEALTHY, severity, values, quarter))
    return out


def generated(
    network: Network, classes: Sequence[str], healthy: bool, runtime: Runtime
) -> list[InjuryWindow]:
    """Windows of generated walks, with the links of each class hurt at each severity and speed.

    healthy: whether to add healthy walks.
    """
    assert network.skeleton is not None
    cases = [(name, s, v) for name, s, v in product(classes, SEVERITIES, SPEEDS)]
    cases += [(HEALTHY, 0.0, v) for v in SPEEDS] if healthy else []
    hurt = [{} if name == HEALTHY else dict.fromkeys(name.split(" and "), s) for name, s, _ in cases]
    script = CrowdTarget(
        WARM_UP + USED, ["walk"] * len(cases), severities(network, hurt), [v for *_, v in cases]
    )
    walks = run_walks(network, [script], runtime)
    out = []
    for i, (name, severity, speed) in enumerate(cases):
        for start in range(WARM_UP, WARM_UP + USED - WINDOW + 1, STEP):
            span = slice(start, start + WINDOW)
            values = _values(
                network.skeleton, walks.local[:, i], walks.contacts[:, i], walks.root[:, i], span
            )
            out.append(InjuryWindow(f"{name} {severity:g} {speed:g}", name, severity, values, 0))
    return out


def parts_of_classes(skeleton: Skeleton) -> PartsOfClass:
    """A function that returns the parts of the body that hurt in a class, without left and right.

    For the class "LeftLeg-LeftFoot" it returns ("shank",), for HEALTHY ().
    """
    pairs = dict(zip(skeleton.link_names, skeleton.links, strict=True))

    def parts(name: str) -> tuple[str, ...]:
        if name == HEALTHY:
            return ()
        return tuple(sorted({part_of_link(skeleton, pairs[link]).name for link in name.split(" and ")}))

    return parts


def table(windows: Sequence[InjuryWindow]) -> Array:
    """(n, D) features of n windows."""
    return np.array([list(w.values.values()) for w in windows])


def rows(result: Recognition) -> list[Row]:
    """The confusion tables as flat rows: kind of motion, what hurts, what was recognised, count."""
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
    """recognition.json, and all its confusion tables as one table."""
    # Hurt versions are left out, because they are generated from healthy clips by rules for each injury. The
    # classifier would learn these rules.
    clips = {clip: file for clip, file in inputs.clips.items() if not HURT_VERSION.search(clip)}
    summaries = [file for file in inputs.summaries if file.stem in clips]
    sample = sample_of(replace(inputs, summaries=summaries), options)
    result = recognition(
        load_network(inputs.weights),
        captured_motion(clips, sample),
        inputs.splits,
        configuration=inputs.configuration,
        runtime=inputs.runtime,
        people=inputs.published["recognition"]["share"],
    )
    right = f"{result['generated']['right']} of generated windows named right" if result["applies"] else ""
    return Outcome(with_sample(result, sample), {"confusion": rows(result)}, right or result["reason"])


def _values(skeleton: Skeleton, local: Array, contacts: Array, root: Array, span: slice) -> dict[str, float]:
    return features(skeleton, local[span], contacts[span], root[span])


def _cross_validated(windows: Sequence[InjuryWindow], parts_of_class: PartsOfClass) -> RecognisedWindows:
    """How windows are recognised if a classifier judges each quarter and learns from the other three."""
    judged: list[InjuryWindow] = []
    named: list[str] = []
    for quarter in range(FOLDS):
        rest = [w for w in windows if w.quarter != quarter]
        of_quarter = [w for w in windows if w.quarter == quarter]
        if of_quarter and len({w.hurt for w in rest}) > 1:
            named += learn(table(rest), [w.hurt for w in rest]).names(table(of_quarter))
            judged += of_quarter
    return _confusion(sorted({w.hurt for w in windows}), judged, named, parts_of_class)


def _judged(
    classifier: Discriminant, windows: Sequence[InjuryWindow], parts_of_class: PartsOfClass
) -> RecognisedWindows:
    return _confusion(
        classifier.classes, windows, classifier.names(table(windows)) if windows else [], parts_of_class
    )


def _by_walk(
    classifier: Discriminant, windows: Sequence[InjuryWindow], parts_of_class: PartsOfClass
) -> RecognisedWindows:
    """One answer for each walk, from all its windows together."""
    scores = classifier.scores(table(windows))
    walks, named = [], []
    for walk in dict.fromkeys(w.clip for w in windows):
        of_walk = [i for i, w in enumerate(windows) if w.clip == walk]
        walks.append(windows[of_walk[0]])
        named.append(classifier.classes[int(np.argmax(scores[of_walk].sum(axis=0)))])
    return _confusion(classifier.classes, walks, named, parts_of_class, "walks")


def _confusion(
    classes: Sequence[str],
    windows: Sequence[InjuryWindow],
    named: Sequence[str],
    parts_of_class: PartsOfClass,
    what: str = "windows",
) -> RecognisedWindows:
    """How windows were recognised. named: the recognised class of each window.

    what: "windows", or "walks" if each window stands for a whole walk.
    """
    counts = {h: dict.fromkeys(classes, 0) for h in sorted({w.hurt for w in windows})}
    right: dict[float, list[bool]] = {}
    for w, name in zip(windows, named, strict=True):
        counts[w.hurt][name] += 1
        right.setdefault(w.severity, []).append(w.hurt == name)
    found = {
        what: len(windows),
        "right": _share([r for some in right.values() for r in some]),
        "right_without_side": _share(
            [parts_of_class(w.hurt) == parts_of_class(name) for w, name in zip(windows, named, strict=True)]
        ),
        "by_severity": [
            {"severity": s, what: len(some), "right": _share(some)} for s, some in sorted(right.items())
        ],
        "confusion": counts,
    }
    return cast(RecognisedWindows, found)


def _share(right: Sequence[bool]) -> float | None:
    return round(sum(right) / len(right), 5) if right else None
