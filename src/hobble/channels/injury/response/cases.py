"""Measures three more cases: a second injury, a change from walking to jogging, and divided severities.

A link is the piece of the body between two neighbouring joints. All figures (copies of the character) walk at
once, each with its own injuries. A stretch is a range of frames in which all severities and gaits stay the
same. The distance of a walk from a reference walk is the mean distance of its joints, in cm, from the mean
cycle of the reference walk at the same phase. The spread of the reference walk, which is its distance from
its own mean cycle, is subtracted.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from hobble.channels.injury.crowd_severities import severity_inputs
from hobble.channels.injury.response.results import Divided, IntoAJog, SecondInjury
from hobble.channels.injury.response.sweep import WALK_IN
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.hurt.effects import part_of_link
from hobble.measures.walks import (
    FPS,
    CrowdTarget,
    Walks,
    distance_to_cycle,
    gait_measures,
    generate_walks,
    mean_cycle,
    spearman,
)
from hobble.models.network import Network
from hobble.runtime.options import Runtime

FIRST_SEVERITY = 7.0  # of the first of two injuries
SECOND_SEVERITIES = (0.0, 5.0, 10.0)  # of the second of two injuries, in the order of the stretches
SEVERITIES_TO_DIVIDE = (0.0, 2.5, 5.0, 7.5, 10.0)  # each is divided by each of DIVISORS
DIVISORS = (1.0, 2.0, 5.0)
JOG_SEVERITIES = (5.0, 10.0)  # of figures that change from walking to jogging
JOG_SPEED_SHARE = 0.9  # a figure jogs once it has this share of its final speed


def _frame_count(share: float, seconds: float) -> int:
    """Length in frames of a stretch that lasts `share` times `seconds`; at least 4."""
    return max(4, round(share * seconds * FPS))


def _mean_cycle(walks: Walks, stretch: int, figure: int) -> Array:
    """The mean pose of a figure in each phase bin of its gait cycle, measured in a stretch."""
    span = walks.measured_frames(stretch, figure)
    return mean_cycle(walks.local[span, figure], walks.phase[span, figure])


def _distance_from_cycle(walks: Walks, stretch: int, figure: int, cycle: Array) -> float:
    """Mean distance of a figure's poses in a stretch from `cycle`, cm."""
    span = walks.measured_frames(stretch, figure)
    return float(np.mean(distance_to_cycle(walks.local[span, figure], walks.phase[span, figure], cycle)))


def _mean_speed(network: Network, walks: Walks, stretch: int, figure: int) -> float:
    """A figure's mean speed in a stretch, cm/s."""
    assert network.skeleton is not None
    span = walks.measured_frames(stretch, figure)
    local, contacts, root = (a[span, figure] for a in (walks.local, walks.contacts, walks.root))
    return float(gait_measures(network.skeleton, local, contacts, root)["speed"] or 0.0)


def second_injuries(
    network: Network, links: Sequence[str], seconds: float, runtime: Runtime
) -> list[SecondInjury]:
    """Walks in which a first link hurts at severity 7 and a second link at severities 0, 5 and 10.

    There is one first link for each part of the body (`first_link_of_each_part`), because all 30 links would
    take longer than all other measurements. Each of the other links is a second link. The result has an
    entry for each pair.

    Keys of an entry. first, second: the links. from_first_cm: distance between the walk with both injuries,
    the second at 10, and the walk with only the first. share: `from_first_cm`, divided by the distance
    between the walk with only the second injury and the healthy walk; None if this distance is at most
    0.05 cm. from_second_cm: distance between the walk with both injuries and the walk with only the second.
    It is 0 if the first injury does not show. spearman: rank correlation between the severity of the second
    injury and the distance from the walk with only the first.
    """
    assert network.skeleton is not None
    firsts = first_link_of_each_part(network.skeleton, links)
    # (first link, second link) of each figure. Where the first is None, the second hurts alone.
    pairs = [(a, b) for a, b in product([None, *firsts], links) if a != b]
    gait = ["walk"] * len(pairs)

    def with_second_at(severity: float) -> dict[str, Array]:
        each = [{**({a: FIRST_SEVERITY} if a else {}), b: severity} for a, b in pairs]
        return severity_inputs(network, each)

    healthy = severity_inputs(network, [{}] * len(pairs))
    script = [CrowdTarget(_frame_count(WALK_IN, seconds), gait, healthy)]
    script += [CrowdTarget(_frame_count(1, seconds), gait, with_second_at(s)) for s in SECOND_SEVERITIES]
    walks = generate_walks(network, script, runtime)
    last = len(SECOND_SEVERITIES)  # index of the last stretch, because stretch 0 is only the beginning
    alone = {b: _effect_of_one(walks, last, i) for i, (a, b) in enumerate(pairs) if a is None}
    out: list[SecondInjury] = []
    for i, (first, second) in enumerate(pairs):
        if first is None:
            continue
        cycle_of_second, spread, effect_alone = alone[second]
        cycle_of_first = _mean_cycle(walks, 1, i)
        from_first = [_distance_from_cycle(walks, 1 + k, i, cycle_of_first) for k in range(last)]
        added = from_first[-1] - from_first[0]  # the second item is the spread
        from_second = _distance_from_cycle(walks, last, i, cycle_of_second) - spread
        out.append(
            {
                "first": first,
                "second": second,
                "from_first_cm": round(added, 5),
                "share": round(added / effect_alone, 5) if effect_alone > 0.05 else None,
                "from_second_cm": round(from_second, 5),
                "spearman": spearman(SECOND_SEVERITIES, from_first),
            }
        )
    return out


def _effect_of_one(walks: Walks, last: int, figure: int) -> tuple[Array, float, float]:
    """What one injury does to a figure that is healthy in stretch 1 and hurt in stretch `last`.

    Returns three items: the mean cycle of the hurt walk; the mean distance of the hurt walk from this cycle
    (its spread), cm; and the effect, cm. The effect is the distance of the hurt walk from the mean healthy
    cycle, minus the distance of the healthy walk from the same cycle.
    """
    healthy, cycle = _mean_cycle(walks, 1, figure), _mean_cycle(walks, last, figure)
    effect = _distance_from_cycle(walks, last, figure, healthy) - _distance_from_cycle(
        walks, 1, figure, healthy
    )
    return cycle, _distance_from_cycle(walks, last, figure, cycle), effect


def first_link_of_each_part(skeleton: Skeleton, links: Sequence[str]) -> list[str]:
    """For each part of the body (such as the thigh), the first of `links` that belongs to it.

    Left and right count as the same part.
    """
    pairs = dict(zip(skeleton.link_names, skeleton.links, strict=True))
    first: dict[str, str] = {}
    for link in links:
        first.setdefault(part_of_link(skeleton, pairs[link]).name, link)
    return list(first.values())


def into_a_jog(network: Network, links: Sequence[str], seconds: float, runtime: Runtime) -> list[IntoAJog]:
    """Figures that change from walking to jogging: one without injury, then each link at severities 5 and 10.

    The result has an entry for each figure.

    Keys of an entry. link: None for the healthy figure. severity: 0, 5 or 10. walk_speed, jog_speed: cm/s.
    reach_seconds: time from the change until the figure has nine tenths of `jog_speed`; None if it never has.
    walk_from_healthy_cm, jog_from_healthy_cm: distance of the walk from the healthy walk, and of the jog from
    the healthy jog. kept: `jog_from_healthy_cm`, divided by `walk_from_healthy_cm`. It is 0 if the injury
    does not show in the jog, and None if it changes the walk by at most 0.05 cm. largest_acceleration: of any
    joint in the first `seconds` of the jog, cm per frame squared.
    """
    # (link, severity) of each figure.
    figures: list[tuple[str | None, float]] = [(None, 0.0), *product(links, JOG_SEVERITIES)]
    hurt = severity_inputs(network, [{link: s} if link else {} for link, s in figures])
    frames = _frame_count(1, seconds)
    walk, jog = ["walk"] * len(figures), ["jog"] * len(figures)
    walks = generate_walks(
        network,
        [
            CrowdTarget(frames, walk, hurt),  # stretch 0: the figures reach their speed
            CrowdTarget(frames, walk, hurt),
            CrowdTarget(2 * frames, jog, hurt),
        ],
        runtime,
    )
    healthy = {stretch: _mean_cycle(walks, stretch, 0) for stretch in (1, 2)}
    spread = {stretch: _distance_from_cycle(walks, stretch, 0, healthy[stretch]) for stretch in (1, 2)}
    jog_start = int(walks.starts[2])  # a frame
    out: list[IntoAJog] = []
    for i, (link, severity) in enumerate(figures):
        walking, jogging = (_distance_from_cycle(walks, s, i, healthy[s]) - spread[s] for s in (1, 2))
        jog_speed = _mean_speed(network, walks, 2, i)
        speeds = np.linalg.norm(np.diff(walks.root[jog_start:, i, ::2], axis=0), axis=1) * FPS
        fast = np.flatnonzero(speeds >= JOG_SPEED_SHARE * jog_speed)
        out.append(
            {
                "link": link,
                "severity": severity,
                "walk_speed": round(_mean_speed(network, walks, 1, i), 5),
                "jog_speed": round(jog_speed, 5),
                "reach_seconds": round(float(fast[0]) / FPS, 5) if len(fast) else None,
                "walk_from_healthy_cm": round(walking, 5),
                "jog_from_healthy_cm": round(jogging, 5),
                "kept": round(jogging / walking, 5) if walking > 0.05 else None,
                "largest_acceleration": round(
                    float(walks.acceleration[jog_start : jog_start + frames, i].max()), 5
                ),
            }
        )
    return out


def divided_severities(
    network: Network, links: Sequence[str], seconds: float, runtime: Runtime
) -> list[Divided]:
    """How much of each link's effect remains if the runtime divides severities by 1, 2 or 5.

    The result has an entry for each divisor, link and severity; `Divided` explains its keys.
    """
    gait = ["walk"] * len(links)
    script = [CrowdTarget(_frame_count(WALK_IN, seconds), gait, severity_inputs(network, [{}] * len(links)))]
    script += [
        CrowdTarget(_frame_count(1, seconds), gait, severity_inputs(network, [{link: s} for link in links]))
        for s in SEVERITIES_TO_DIVIDE
    ]
    out: list[Divided] = []
    for divisor in DIVISORS:
        scales = {**runtime.scales, "injury": divisor}
        walks = generate_walks(network, script, runtime.model_copy(update={"scales": scales}))
        for i, link in enumerate(links):
            healthy = _mean_cycle(walks, 1, i)
            spread, speed = _distance_from_cycle(walks, 1, i, healthy), _mean_speed(network, walks, 1, i)
            for k, severity in enumerate(SEVERITIES_TO_DIVIDE):
                out.append(
                    {
                        "scale": divisor,
                        "link": link,
                        "severity": severity,
                        "from_healthy_cm": round(_distance_from_cycle(walks, 1 + k, i, healthy) - spread, 5),
                        "speed_share": round(_mean_speed(network, walks, 1 + k, i) / max(speed, 1e-9), 5),
                    }
                )
    return out
