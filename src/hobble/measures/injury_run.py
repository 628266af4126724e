"""Measures how a walk changes while the severity of one link rises from 0 to 10.

A link is the piece of the body between two neighbouring joints. All figures (copies of the character) walk at
once, each with its own injuries, in stretches in which severities and gaits stay the same. In the sweep there
is a figure for each link. It walks healthy until it has reached its speed. Then the severity of its link is
0, 1, ..., 10, and 0 again for two stretches, of which the second is measured. The other experiments of Ferre
et al. (2019) are made, too: a second injury, a change from walking to jogging, and divided severities.

The distance of a walk from a reference walk is the mean distance of its joints, in cm, from the mean cycle of
the reference walk at the same phase. The spread of a walk is its distance from its own mean cycle.
"""

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
import pandas

from hobble.channels.injury.shown import SLIDERS, link_of_part
from hobble.core.quat import Array
from hobble.measures import walks
from hobble.measures.measure import MeasureInputs, Outcome
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime import Runtime

INJURY = "injury"  # the channel
SEVERITIES = np.arange(11.0)
WALK_IN = 0.75  # time at the beginning in which figures reach their speed, as a share of a stretch's time
# The experiment of Ferre et al. with two injuries: a first one at each of FIRST_SEVERITIES, while the second
# one is swept over SEVERITIES, for the pairs of parts that hurt in their films.
FIRST_SEVERITIES = (5.0, 10.0)
PAIRS = (("left shank", "right thigh"), ("left shank", "right shank"), ("right thigh", "right shank"))
CHANGE_BEGINS, CHANGE_ENDS = 0.1, 0.9  # shares of the whole change of a walk at which it begins and is over
SEVERITIES_TO_DIVIDE = (0.0, 2.5, 5.0, 7.5, 10.0)  # each is divided by each of DIVISORS
DIVISORS = (1.0, 2.0, 5.0)
STRIP_SEVERITIES = (0, 4, 7, 10)  # of the poses of a strip, as in Figure 3 of Ferre et al.
SECOND_STRIP = (0, 5)  # severities of the second injury in a strip, as in their Figure 4
JOG_SPEED_SHARE = 0.9  # a figure jogs once it has this share of its final speed
LEAST_EFFECT_CM = 0.05  # no share of a smaller effect is computed
# Keys of a response of which `summary` has the mean.
SUMMARISED = (
    "spearman_from_healthy",
    "spearman_speed",
    "from_healthy_cm",
    "after_healing_cm",
    "speed_share",
    "acceleration_share",
)
Rows = list[dict[str, Any]]
Injury = Mapping[str, float]  # link -> severity
Stretch = tuple[float, Sequence[Injury]]  # length as a share of the time, and the injury of each figure


def walk_crowd(
    network: Network, stretches: Sequence[Stretch], seconds: float, runtime: Runtime
) -> walks.Walks:
    """Let a crowd walk. seconds: the time of a stretch of length 1.

    Before the given stretches, there is one (stretch 0) in which the figures reach their speed, with the
    injuries of the first stretch.
    """
    script = []
    for share, injuries in [(WALK_IN, stretches[0][1]), *stretches]:
        cases = [{INJURY: injury} for injury in injuries]
        script.append(walks.CrowdTarget(_frames(share * seconds), ["walk"] * len(cases), cases))
    return walks.generate_walks(network, script, runtime)


def _frames(seconds: float) -> int:
    return max(4, round(seconds * walks.FPS))


def injury_response(
    network: Network,
    *,
    configuration: str,
    runtime: Runtime,
    seconds: float,
    links: Sequence[str] | None = None,
) -> dict[str, Any]:
    """The content of injury.json; docs/artefacts.md explains its keys.

    configuration: its name. seconds: time at each severity. links: the links to hurt, by default all.
    """
    links = list(links or network.channels[INJURY])
    trained = [link for link in links if link in network.trained_labels(INJURY)]
    found = {
        **sweep(network, links, trained, seconds, runtime),
        **second_sweep(network, trained, seconds, runtime),
    }
    strips, responses = found.pop("strips") + found.pop("second_strips"), found["responses"]
    return {
        "configuration": configuration,
        "applies": True,
        "mode": runtime.mode,
        "seconds": seconds,
        "severities": SEVERITIES.tolist(),
        "links": links,
        "trained": trained,
        **found,
        "into_a_jog": into_a_jog(network, trained, seconds, runtime),
        "divided": divided_severities(network, trained, seconds, runtime),
        "strips": strips,
        "summary": summarise([r for r in responses if r["trained"]]),
    }


def sweep(
    network: Network, links: Sequence[str], trained: Sequence[str], seconds: float, runtime: Runtime
) -> dict[str, Rows]:
    """`rows`, `responses` and the first `strips` of `injury_response`."""
    stretches = [(1, [{link: severity} for link in links]) for severity in (*SEVERITIES, 0.0, 0.0)]
    crowd = walk_crowd(network, stretches, seconds, runtime)
    found: dict[str, Rows] = {"rows": [], "responses": [], "strips": []}
    for figure, link in enumerate(links):
        rows = sweep_rows(crowd, figure, link)
        found["rows"] += rows
        labels = {"link": link, "trained": link in trained}
        found["responses"].append({**labels, **respond(crowd, figure, rows)})
        if link in trained:
            cycles = [crowd.cycle(1 + severity, figure) for severity in STRIP_SEVERITIES]
            strip = {"link": link, "first": None, **strip_of(cycles), "severities": STRIP_SEVERITIES}
            found["strips"].append(strip)
    return found


def strip_of(cycles: Sequence[Array]) -> dict[str, Any]:
    """Poses (J, 3), cm, at one phase of some mean cycles: where the last differs most from the first."""
    at = int(np.linalg.norm(cycles[-1] - cycles[0], axis=-1).mean(axis=1).argmax())
    return {"phase": round(at / len(cycles[0]), 5), "poses": [np.round(c[at], 1).tolist() for c in cycles]}


def sweep_rows(crowd: walks.Walks, figure: int, link: str) -> Rows:
    """One row for each of SEVERITIES: labels, `gait_measures` and distances.

    from_healthy, from_worst: distance from the healthy walk, and from the walk at severity 10.
    """
    healthy, worst = (crowd.cycle(stretch, figure) for stretch in (1, len(SEVERITIES)))
    return [
        walks.rounded(
            {
                "link": link,
                "severity": float(severity),
                **crowd.measures(at, figure),
                "from_healthy": crowd.distance(at, figure, healthy),
                "from_worst": crowd.distance(at, figure, worst),
                "largest_acceleration": float(
                    crowd.acceleration[crowd.measured_frames(at, figure), figure].max()
                ),
            }
        )
        for at, severity in enumerate(SEVERITIES, 1)
    ]


def respond(crowd: walks.Walks, figure: int, rows: Rows) -> dict[str, Any]:
    """How a walk responds to severity. rows: from `sweep_rows`.

    spearman: measure of the walk -> its rank correlation with severity, None if the measure is constant.
    from_healthy_cm: distance from the healthy walk at severity 10. after_healing_cm: the same distance at the
    end, when severity is 0 again. From both, the spread of the healthy walk is subtracted. speed_share: speed
    at severity 10, divided by the healthy speed; None if the healthy figure stands still.
    """
    healthy, worst, end = rows[0], rows[-1], len(SEVERITIES) + 1
    largest = crowd.roughness(figure, 1, end)
    measures = [name for name in healthy if name not in ("link", "severity")]
    found = {
        "spearman": {n: walks.spearman(SEVERITIES, [row[n] for row in rows]) for n in measures},
        "from_healthy_cm": worst["from_healthy"] - healthy["from_healthy"],
        "after_healing_cm": crowd.change(end + 1, figure, 1),
        "speed_share": worst["speed"] / healthy["speed"] if healthy["speed"] > 0 else None,
        "largest_acceleration": largest,
        "acceleration_share": largest / max(healthy["largest_acceleration"], 1e-9),
    }
    return walks.rounded(found)


def second_sweep(network: Network, links: Sequence[str], seconds: float, runtime: Runtime) -> dict[str, Rows]:
    """The experiment of Ferre et al. (2019) with two injuries.

    second_sweep: for each of PAIRS whose links are in `links`, and each of FIRST_SEVERITIES, a row for each
    severity of the second injury. from_first_cm, from_second_cm: distance from the walk with only the first
    injury, and from that with only the second at the same severity. speed, speed_of_first, speed_of_second:
    cm/s, with both and with only one. second_thresholds: from `thresholds_of`. second_strips: poses without
    and with a second injury.
    """
    assert network.skeleton is not None
    named = {label: link for label in SLIDERS if (link := link_of_part(network.skeleton, label, links))}
    pairs = [(named[a], named[b]) for a, b in PAIRS if a in named and b in named]
    found: dict[str, Rows] = {"second_sweep": [], "second_thresholds": [], "second_strips": []}
    if not pairs:
        return found
    single = list(dict.fromkeys(sum(pairs, ())))  # the first figures have only one injury
    cases = [(first, severity, second) for (first, second), severity in product(pairs, FIRST_SEVERITIES)]

    def injuries(second: float) -> list[Injury]:
        return [*({link: second} for link in single), *({a: first, b: second} for a, first, b in cases)]

    stretches = [(1, injuries(severity)) for severity in SEVERITIES]
    crowd = walk_crowd(network, stretches, seconds, runtime)
    for i, (first, first_severity, second) in enumerate(cases, len(single)):
        labels = {"first": first, "second": second, "first_severity": first_severity}
        alone = single.index(second)
        rows = [
            walks.rounded(
                {
                    **labels,
                    "severity": float(severity),
                    "from_first_cm": crowd.change(at, i, 1),
                    "from_second_cm": crowd.change(at, i, at, alone),
                    "speed": crowd.speed(at, i),
                    "speed_of_first": crowd.speed(1 + int(first_severity), single.index(first)),
                    "speed_of_second": crowd.speed(at, alone),
                }
            )
            for at, severity in enumerate(SEVERITIES, 1)
        ]
        found["second_sweep"] += rows
        found["second_thresholds"].append({**labels, **thresholds_of(rows, int(first_severity))})
        if first_severity == FIRST_SEVERITIES[0]:
            strip = strip_of([crowd.cycle(1 + severity, i) for severity in SECOND_STRIP])
            found["second_strips"].append({"link": second, **labels, **strip, "severities": SECOND_STRIP})
    return found


def thresholds_of(rows: Rows, equal: int) -> dict[str, float | None]:
    """At which severity of the second injury a walk with two injuries changes.

    begins, capped: it begins to change, and has changed, by the shares CHANGE_BEGINS and CHANGE_ENDS of its
    whole change. second_leads: it is nearer to the walk with only the second injury. These are None if it
    does not change, or is never nearer. equal_speed_share: how fast both injuries at the same severity are,
    from 0 (as the slower of the walks with only one) to 1 (as the faster). rows: of one pair and severity of
    the first. equal: this severity.
    """
    whole = rows[-1]["from_first_cm"]
    reached = {
        "begins": lambda row: row["from_first_cm"] >= CHANGE_BEGINS * whole > CHANGE_BEGINS * LEAST_EFFECT_CM,
        "capped": lambda row: row["from_first_cm"] >= CHANGE_ENDS * whole > CHANGE_ENDS * LEAST_EFFECT_CM,
        "second_leads": lambda row: row["from_second_cm"] < row["from_first_cm"],
    }
    slow, fast = sorted((rows[equal]["speed_of_first"], rows[equal]["speed_of_second"]))
    share = (rows[equal]["speed"] - slow) / (fast - slow) if fast > slow else None
    return {
        name: next((row["severity"] for row in rows if is_reached(row)), None)
        for name, is_reached in reached.items()
    } | walks.rounded({"equal_speed_share": share})


def into_a_jog(network: Network, links: Sequence[str], seconds: float, runtime: Runtime) -> Rows:
    """Figures that change from walking to jogging: one without injury, then each link at severities 1 to 10.

    link: None for the healthy figure. walk_speed, jog_speed: cm/s. reach_seconds: time from the change until
    the figure has nine tenths of `jog_speed`; None if it never has. walk_from_healthy_cm,
    jog_from_healthy_cm: distance of the walk from the healthy walk, and of the jog from the healthy jog.
    kept: the latter divided by the former. It is 0 if the injury does not show in the jog.
    largest_acceleration: of any joint in the first `seconds` of the jog, cm per frame squared.
    """
    figures: list[tuple[str | None, float]] = [(None, 0.0), *product(links, SEVERITIES[1:].tolist())]
    hurt, gaits = [{INJURY: {link: s} if link else {}} for link, s in figures], ("walk", "walk", "jog")
    frames = _frames(seconds)
    # In stretch 0 the figures reach their speed.
    script = [
        walks.CrowdTarget(length, [gait] * len(figures), hurt)
        for length, gait in zip((frames, frames, 2 * frames), gaits, strict=True)
    ]
    crowd, out = walks.generate_walks(network, script, runtime), []
    start = int(crowd.starts[2])  # the first frame of the jog
    for i, (link, severity) in enumerate(figures):
        walking, jogging = (crowd.change(stretch, i, stretch, 0) for stretch in (1, 2))
        jog_speed = crowd.speed(2, i)
        speeds = np.linalg.norm(np.diff(crowd.root[start:, i, ::2], axis=0), axis=1) * walks.FPS
        fast = np.flatnonzero(speeds >= JOG_SPEED_SHARE * jog_speed)
        row = {
            "link": link,
            "severity": severity,
            "walk_speed": crowd.speed(1, i),
            "jog_speed": jog_speed,
            "reach_seconds": float(fast[0]) / walks.FPS if len(fast) else None,
            "walk_from_healthy_cm": walking,
            "jog_from_healthy_cm": jogging,
            "kept": jogging / walking if walking > LEAST_EFFECT_CM else None,
            "largest_acceleration": float(crowd.acceleration[start : start + frames, i].max()),
        }
        out.append(walks.rounded(row))
    return out


def divided_severities(network: Network, links: Sequence[str], seconds: float, runtime: Runtime) -> Rows:
    """How much of each link's effect remains if the runtime divides severities by `scale`: 1, 2 or 5.

    from_healthy_cm: distance from the healthy walk. speed_share: speed, divided by the healthy speed.
    largest_acceleration: of any joint from the change to this severity on, cm per frame squared.
    """
    stretches = [(1, [{link: severity} for link in links]) for severity in SEVERITIES_TO_DIVIDE]
    out = []
    for divisor in DIVISORS:
        divided = runtime.model_copy(update={"scales": {**runtime.scales, INJURY: divisor}})
        crowd = walk_crowd(network, stretches, seconds, divided)
        for (i, link), (at, severity) in product(enumerate(links), enumerate(SEVERITIES_TO_DIVIDE, 1)):
            row = {
                "scale": divisor,
                "link": link,
                "severity": severity,
                "from_healthy_cm": crowd.change(at, i, 1),
                "speed_share": crowd.speed(at, i) / max(crowd.speed(1, i), 1e-9),
                "largest_acceleration": crowd.roughness(i, at, at + 1),
            }
            out.append(walks.rounded(row))
    return out


def summarise(responses: Rows) -> dict[str, float | None]:
    """Means over `responses`, which are of several links. Empty if there are no responses."""
    if not responses:
        return {}
    means = pandas.json_normalize(responses, sep="_")[list(SUMMARISED)].astype(float).mean()
    return walks.rounded(means.to_dict())


def run(inputs: MeasureInputs, options: Any) -> Outcome:
    """The content of injury.json and of the tables in injury/."""
    result = injury_response(
        load_network(inputs.weights),
        configuration=inputs.configuration,
        runtime=inputs.runtime,
        seconds=options.seconds,
    )
    names = ("second_sweep", "second_thresholds", "into_a_jog", "divided")
    tables = {"sweep": result["rows"], **{name: result[name] for name in names}}
    return Outcome(result, tables, str(result["summary"]))
