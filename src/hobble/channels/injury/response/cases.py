"""Further tests of injuries: a second injury, a change from walking to jogging, and divided severities.

A link is a pair of neighbouring joints. All figures walk at once, each with its own injuries. A stretch is a
number of frames in which these stay the same. Distances are means over joints at the same phase.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from hobble.channels.injury.crowd_severities import severities
from hobble.channels.injury.response.results import Divided, IntoAJog, SecondInjury
from hobble.channels.injury.response.sweep import WALK_IN
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.evaluation.crowd import FPS, CrowdTarget, Walks, run
from hobble.evaluation.motion_measures import gait_measures
from hobble.evaluation.pose_distance import distance_to_cycle, mean_cycle
from hobble.evaluation.spearman import spearman
from hobble.hurt.body_parts import part_of_link
from hobble.models.network import Network
from hobble.runtime.options import Runtime

FIRST = 7.0  # severity of a first injury, to which a second one is added
SECOND = (0.0, 5.0, 10.0)  # severities of the second injury
DIVIDED = (0.0, 2.5, 5.0, 7.5, 10.0)  # severities that are divided by each of SCALES
SCALES = (1.0, 2.0, 5.0)  # divisors of the severities
INTO_A_JOG = (0.0, 5.0, 10.0)  # severities of figures that change from walking to jogging
JOGGING = 0.9  # a figure jogs once it has this share of its final speed


def _frames(share: float, seconds: float) -> int:
    """Length of a stretch that lasts for `share` of `seconds`."""
    return max(4, round(share * seconds * FPS))


def _cycle(walks: Walks, stretch: int, figure: int) -> Array:
    """The mean gait cycle of a figure in a stretch."""
    span = walks.measured_frames(stretch, figure)
    return mean_cycle(walks.local[span, figure], walks.phase[span, figure])


def _distance_from_cycle(walks: Walks, stretch: int, figure: int, cycle: Array) -> float:
    """Mean distance of a figure's poses in a stretch from `cycle`, cm."""
    span = walks.measured_frames(stretch, figure)
    return float(np.mean(distance_to_cycle(walks.local[span, figure], walks.phase[span, figure], cycle)))


def _speed(network: Network, walks: Walks, stretch: int, figure: int) -> float:
    """A figure's speed in a stretch, cm/s."""
    assert network.skeleton is not None
    span = walks.measured_frames(stretch, figure)
    local, contacts, root = (a[span, figure] for a in (walks.local, walks.contacts, walks.root))
    return float(gait_measures(network.skeleton, local, contacts, root)["speed"] or 0.0)


def second_injuries(
    network: Network, links: Sequence[str], seconds: float, runtime: Runtime
) -> list[SecondInjury]:
    """Walks with a first link at severity 7 and every other link as a second one at severities 0, 5 and 10.

    There is one first link for each part of the body (`one_of_each_part`), because all 30 links would take
    longer than all other measurements. `from_first_cm`: distance of the walk with the second link at 10 from
    the walk with the first alone. `share`: this distance, divided by the second link's effect on a healthy
    body; None if this effect is at most 0.05 cm. `from_second_cm`: distance of the walk with both links hurt,
    the second at 10, from the walk with the second alone; 0 if the second injury hides the first. `spearman`:
    rank correlation between the severity of the second link and the distance from the walk with the first
    alone.
    """
    assert network.skeleton is not None
    firsts = one_of_each_part(network.skeleton, links)
    pairs = [(a, b) for a, b in product([None, *firsts], links) if a != b]
    gait = ["walk"] * len(pairs)

    def hurt(second: float) -> dict[str, Array]:
        each = [{**({a: FIRST} if a else {}), b: second} for a, b in pairs]
        return severities(network, each)

    healthy = severities(network, [{}] * len(pairs))
    script = [CrowdTarget(_frames(WALK_IN, seconds), gait, healthy)]
    script += [CrowdTarget(_frames(1, seconds), gait, hurt(s)) for s in SECOND]
    walks = run(network, script, runtime)
    last = len(SECOND)
    alone = {b: _effect_of_one(walks, last, i) for i, (a, b) in enumerate(pairs) if a is None}
    out: list[SecondInjury] = []
    for i, (first, second) in enumerate(pairs):
        if first is None:
            continue
        cycle_of_second, spread, effect_alone = alone[second]
        cycle_of_first = _cycle(walks, 1, i)
        from_first = [_distance_from_cycle(walks, 1 + k, i, cycle_of_first) for k in range(last)]
        added = from_first[-1] - from_first[0]
        from_second = _distance_from_cycle(walks, last, i, cycle_of_second) - spread
        out.append(
            {
                "first": first,
                "second": second,
                "from_first_cm": round(added, 5),
                "share": round(added / effect_alone, 5) if effect_alone > 0.05 else None,
                "from_second_cm": round(from_second, 5),
                "spearman": spearman(SECOND, from_first),
            }
        )
    return out


def _effect_of_one(walks: Walks, last: int, figure: int) -> tuple[Array, float, float]:
    """What one injury does to a figure that is healthy in stretch 1 and hurt in stretch `last`.

    Returns the mean cycle of the hurt walk; the mean distance of the hurt walk from this cycle, cm; and the
    effect: how much farther the hurt walk is from the mean healthy cycle than the healthy walk is, cm.
    """
    healthy, cycle = _cycle(walks, 1, figure), _cycle(walks, last, figure)
    effect = _distance_from_cycle(walks, last, figure, healthy) - _distance_from_cycle(
        walks, 1, figure, healthy
    )
    return cycle, _distance_from_cycle(walks, last, figure, cycle), effect


def one_of_each_part(skeleton: Skeleton, links: Sequence[str]) -> list[str]:
    """For each part of the body, the first of `links` that belongs to it, on the left or on the right."""
    pairs = dict(zip(skeleton.link_names, skeleton.links, strict=True))
    first: dict[str, str] = {}
    for link in links:
        first.setdefault(part_of_link(skeleton, pairs[link]).name, link)
    return list(first.values())


def into_a_jog(network: Network, links: Sequence[str], seconds: float, runtime: Runtime) -> list[IntoAJog]:
    """A change from walking to jogging, for each link at severities 5 and 10, and without injury.

    `kept`: distance of the jog from the healthy jog, as a share of the distance of the walk from the healthy
    walk. It is 0 if the jog shows no injury. None if the injury changes the walk by at most 0.05 cm.
    `reach_seconds`: time from the change until the figure has nine tenths of the jog's speed.
    """
    each = [(link, s) for link, s in product(links, INTO_A_JOG) if s > 0]
    figures: list[tuple[str | None, float]] = [(None, 0.0), *each]
    hurt = severities(network, [{link: s} if link else {} for link, s in figures])
    frames = _frames(1, seconds)
    walk, jog = ["walk"] * len(figures), ["jog"] * len(figures)
    walks = run(
        network,
        [
            CrowdTarget(frames, walk, hurt),
            CrowdTarget(frames, walk, hurt),
            CrowdTarget(2 * frames, jog, hurt),
        ],
        runtime,
    )
    healthy = {stretch: _cycle(walks, stretch, 0) for stretch in (1, 2)}
    spread = {stretch: _distance_from_cycle(walks, stretch, 0, healthy[stretch]) for stretch in (1, 2)}
    start = int(walks.starts[2])  # of the jog
    out: list[IntoAJog] = []
    for i, (link, severity) in enumerate(figures):
        walking, jogging = (_distance_from_cycle(walks, s, i, healthy[s]) - spread[s] for s in (1, 2))
        speed = _speed(network, walks, 2, i)
        speeds = np.linalg.norm(np.diff(walks.root[start:, i, ::2], axis=0), axis=1) * FPS
        fast = np.flatnonzero(speeds >= JOGGING * speed)
        out.append(
            {
                "link": link,
                "severity": severity,
                "walk_speed": round(_speed(network, walks, 1, i), 5),
                "jog_speed": round(speed, 5),
                "reach_seconds": round(float(fast[0]) / FPS, 5) if len(fast) else None,
                "walk_from_healthy_cm": round(walking, 5),
                "jog_from_healthy_cm": round(jogging, 5),
                "kept": round(jogging / walking, 5) if walking > 0.05 else None,
                "largest_acceleration": round(float(walks.acceleration[start : start + frames, i].max()), 5),
            }
        )
    return out


def divided_severities(
    network: Network, links: Sequence[str], seconds: float, runtime: Runtime
) -> list[Divided]:
    """How much of each link's effect remains if severities are divided by 1, 2 or 5 (`runtime.scales`)."""
    gait = ["walk"] * len(links)
    script = [CrowdTarget(_frames(WALK_IN, seconds), gait, severities(network, [{}] * len(links)))]
    script += [
        CrowdTarget(_frames(1, seconds), gait, severities(network, [{link: s} for link in links]))
        for s in DIVIDED
    ]
    out: list[Divided] = []
    for scale in SCALES:
        walks = run(network, script, runtime.model_copy(update={"scales": {"injury": scale}}))
        for i, link in enumerate(links):
            healthy = _cycle(walks, 1, i)
            spread, speed = _distance_from_cycle(walks, 1, i, healthy), _speed(network, walks, 1, i)
            for k, severity in enumerate(DIVIDED):
                out.append(
                    {
                        "scale": scale,
                        "link": link,
                        "severity": severity,
                        "from_healthy_cm": round(_distance_from_cycle(walks, 1 + k, i, healthy) - spread, 5),
                        "speed_share": round(_speed(network, walks, 1 + k, i) / max(speed, 1e-9), 5),
                    }
                )
    return out
