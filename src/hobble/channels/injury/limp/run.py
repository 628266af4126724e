"""Measures the size of each link's limp, and compares it with the limps of people and of captured clips.

A link is a pair of neighbouring joints. A severity from 0 to 10 says how much a link hurts.

The rank correlations of `hobble.channels.injury.response` say nothing about size, because a correlation is 1
even if the walk changes by only 2 %. Here the size of each effect of an injury on the walk is measured at
severities 3, 5, 7 and 10, relative to the healthy walk of the same network. The two recognisers of
`hobble.gait`, a linear and a graded one, judge the walks. They learnt only from real people.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hobble.channels.injury.crowd_severities import injury_links, links_hurt_in_training
from hobble.channels.injury.limp import Options
from hobble.channels.injury.limp.captured_limps import (
    CapturedWalk,
    HurtSeconds,
    captured_walks,
    healthy_reference,
)
from hobble.channels.injury.limp.crowd_walks import FigureWalk, walk_figures
from hobble.channels.injury.limp.with_other_channel import limps_together, named_together
from hobble.core.errors import HobbleError
from hobble.core.skeleton import Skeleton
from hobble.gait.profile import (
    EFFECTS,
    RIGHT,
    Profile,
    effects_of_people,
    features,
    measure_effects,
    profile_of_walk,
)
from hobble.gait.recognise import SIDES, compare_walk, examples_of_people
from hobble.hurt.effects import part_of_link
from hobble.measures.measure import MeasureInputs, Outcome
from hobble.measures.sample import clip_parts, sample_to_measure, with_sample
from hobble.measures.walks import spearman
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.options import Runtime

NO_SEVERITIES = "this network has no severity inputs"
NO_CYCLE = "the network's healthy character does not walk a whole cycle"
SEVERITIES = (3.0, 5.0, 7.0, 10.0)  # of the link that hurts; only one link hurts in a walk
SPEEDS = {"walk": 2.0, "jog": 7.0}  # target speeds, cm a frame; 2 is 1.2 m/s, a usual walking speed
FIRST_SEVERITIES = (5.0, 10.0)  # of the first injury in walks with two injuries
SECOND_SEVERITIES = (5.0, 10.0)  # of the second injury in these walks
LEG = ("hip", "thigh", "shank", "foot")  # parts of the body that belong to a leg
WINDOW_SECONDS = 4.0  # length of the stretches (windows) of a walk that a recogniser judges one by one


def measure_limps(
    network: Network,
    captured: Sequence[CapturedWalk],
    hurt_seconds: HurtSeconds,
    splits: Mapping[str, str],
    *,
    configuration: str,
    runtime: Runtime,
    seconds: float,
    links: Sequence[str] | None = None,
) -> dict[str, Any]:
    """The content of limp.json. If nothing can be measured, `applies` is false and `reason` says why.

    captured: the walks of the data set's captured clips. hurt_seconds: seconds for which each link hurts in
    training. splits: clip -> "train" or "held_out". seconds: length of each generated walk. links: names of
    the links to hurt, by default all.

    Keys of the result. `sizes`: a row for each gait, link and severity, with the effects of
    `hobble.gait.profile` and the limp that is recognised; the link's side counts as the hurt side.
    `trends`: Spearman's rho of each effect with severity, and the size of the effect at severity 10. `named`:
    at each severity, how well the limps of hurt legs are recognised. `people`: for each impairment that
    people imitated, mean and standard deviation of each effect. `captured`: effects in captured clips.
    `held_out_limps`: see `compare_held_out`. `second`: see `second_injuries`. `together` and
    `named_together`: limps while another channel has its highest value, see
    `hobble.channels.injury.limp.with_other_channel`.
    """
    head: dict[str, Any] = {"configuration": configuration}
    if not injury_links(network) or network.skeleton is None:
        return {**head, "applies": False, "reason": NO_SEVERITIES}
    links = list(links or injury_links(network))
    rows = _size_rows(network, links, seconds, runtime)
    if rows is None:
        return {**head, "applies": False, "reason": NO_CYCLE}
    return {
        **head,
        "applies": True,
        "asked_cm_per_second": {gait: 60 * speed for gait, speed in SPEEDS.items()},
        "seconds": seconds,
        "effects": EFFECTS,
        "trained": [link for link in links if link in links_hurt_in_training(network)],
        "hurt_seconds": {"captured": hurt_seconds.captured, "made": hurt_seconds.generated},
        "sizes": rows,
        "trends": _trend_rows(rows),
        "named": _recognition_by_severity(rows),
        "people": {
            gait: {name: [round(v, 5) for v in mean_and_sd] for name, mean_and_sd in of_gait.items()}
            for gait, of_gait in effects_of_people().items()
        },
        "captured": [
            _row_of_clip(network.skeleton, clip, captured) for clip in captured if clip.severity_by_link
        ],
        "held_out_limps": compare_held_out(network, captured, splits, seconds, runtime),
        "second": second_injuries(network, links, seconds, runtime),
        **_limps_with_other_channel(network, links, seconds, runtime),
    }


def _size_rows(
    network: Network, links: Sequence[str], seconds: float, runtime: Runtime
) -> list[dict[str, Any]] | None:
    """A row of `_row_of_walk` for each gait, link and severity.

    None if the healthy character does not walk a whole cycle in the gait "walk". If it does not in another
    gait, the rows of this gait are left out.
    """
    rows: list[dict[str, Any]] = []
    cases = [(link, severity) for link in links for severity in SEVERITIES]
    injuries = [{}, *({link: severity} for link, severity in cases)]
    for gait, speed in SPEEDS.items():
        healthy, *hurt = walk_figures(network, injuries, speed, gait, seconds, runtime)
        if healthy.profile is None:
            if gait == "walk":
                return None
            continue
        rows += [
            _row_of_walk(network, gait, *case, figure, healthy)
            for case, figure in zip(cases, hurt, strict=True)
        ]
    return rows


def _limps_with_other_channel(
    network: Network, links: Sequence[str], seconds: float, runtime: Runtime
) -> dict[str, list[dict[str, Any]]]:
    """The keys `together` and `named_together`: limps while another channel has its highest value."""
    assert network.skeleton is not None
    skeleton = network.skeleton
    legs = [link for link in links if part_of_link(skeleton, _joints_of_link(skeleton, link)).name in LEG]

    def row(link: str, figure: FigureWalk, healthy: FigureWalk) -> dict[str, Any]:
        return _row_of_walk(network, "walk", link, SEVERITIES[-1], figure, healthy)

    rows = limps_together(network, legs, SPEEDS["walk"], seconds, runtime, row)
    return {"together": rows, "named_together": named_together(rows)}


def hurt_side(skeleton: Skeleton, link: str) -> str:
    """The side of the body that a link is on: "left" or "right".

    Links on the midline count as right, because the effects need a hurt side.
    """
    side = part_of_link(skeleton, _joints_of_link(skeleton, link)).side
    return RIGHT if side is None else ("left", "right")[side]


def _joints_of_link(skeleton: Skeleton, link: str) -> tuple[str, str]:
    """The names of the parent joint and the child joint of a link."""
    return skeleton.links[skeleton.link_names.index(link)]


def _row_of_walk(
    network: Network, gait: str, link: str, severity: float, figure: FigureWalk, healthy: FigureWalk
) -> dict[str, Any]:
    """The row of one walk: gait, link and severity, the effects, and how the walk is recognised.

    called: label and side that the linear recogniser gives to the whole walk. graded: label and side that the
    graded recogniser gives to it. impaired: share of windows in which the linear recogniser finds a limp. The
    wrong side is the side opposite to `hurt_side`. named: share of windows in which the graded recogniser
    finds a limp, and not on the wrong side. named_by_either: share of windows in which at least one of the
    two recognisers does. wrong_side: share of windows in which the graded recogniser finds a limp on the
    wrong side; None for a link on the midline. speed_share: speed, divided by the speed of the healthy walk.
    If the figure does not walk a whole cycle, only `speed_share` is measured. The effects and the keys of the
    recognisers are then None.
    """
    assert network.skeleton is not None
    assert healthy.profile is not None
    part = part_of_link(network.skeleton, _joints_of_link(network.skeleton, link))
    side = hurt_side(network.skeleton, link)
    row: dict[str, Any] = {"gait": gait, "link": link, "part": part.name, "severity": severity}
    row["side"] = side if part.side is not None else None
    row["speed_share"] = round(figure.speed / max(healthy.speed, 1e-9), 5)
    if figure.profile is None:
        return {
            **row,
            **dict.fromkeys(EFFECTS),
            **dict.fromkeys(("called", "graded", "impaired", "named", "named_by_either", "wrong_side")),
        }
    row |= _rounded_values(measure_effects(figure.profile, healthy.profile, side))
    found = compare_walk(figure.walk, figure.frames, healthy.profile, WINDOW_SECONDS)
    answers = found.window_answers
    grades = found.window_grades
    wrong_side = SIDES[1 - SIDES.index(side)]
    row["called"] = found.answer.name
    row["graded"] = found.grade.name
    row["impaired"] = _share([a.is_impaired for a in answers])
    by_linear, by_graded = (
        [r.is_impaired and r.side != wrong_side for r in each] for each in (answers, grades)
    )
    row["named"] = _share(by_graded)
    row["named_by_either"] = _share([a or b for a, b in zip(by_linear, by_graded, strict=True)])
    row["wrong_side"] = (
        _share([g.is_impaired and g.side == wrong_side for g in grades]) if part.side is not None else None
    )
    return row


def _rounded_values(values: Mapping[str, float]) -> dict[str, float | None]:
    """The values, rounded to 5 decimals. None in place of a value that is not finite."""
    return {name: round(float(v), 5) if np.isfinite(v) else None for name, v in values.items()}


def _share(values: Sequence[bool]) -> float | None:
    """The share of the values that are True; None if there are no values."""
    return round(sum(values) / len(values), 5) if values else None


def _trend_rows(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """A row for each gait, link and effect: Spearman's rho with severity, and the size at severity 10."""
    out = []
    for gait, link in dict.fromkeys((row["gait"], row["link"]) for row in rows):
        rows_of_link = [row for row in rows if (row["gait"], row["link"]) == (gait, link)]
        for name in EFFECTS:
            values = [row[name] for row in rows_of_link]
            if None not in values:
                rho = spearman([row["severity"] for row in rows_of_link], values)
                out.append({"gait": gait, "link": link, "effect": name, "at_10": values[-1], "spearman": rho})
    return out


def _recognition_by_severity(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """A row for each severity: how well walks with a hurt leg are recognised, as means over these walks."""
    out = []
    for severity in SEVERITIES:
        legs = [r for r in rows if r["gait"] == "walk" and r["severity"] == severity and r["part"] in LEG]
        row: dict[str, Any] = {"severity": severity, "walks": len(legs)}
        for key in ("impaired", "named", "named_by_either", "wrong_side"):
            values = [r[key] for r in legs if r[key] is not None]
            row[key] = round(float(np.mean(values)), 5) if values else None
        out.append(row)
    return out


def _row_of_clip(skeleton: Skeleton, clip: CapturedWalk, captured: Sequence[CapturedWalk]) -> dict[str, Any]:
    """The effects of the injury in a captured clip, relative to a healthy walk.

    Its key `healthy` says whose healthy walk this is (see `healthy_reference`). If several links hurt, the
    side of the one with the highest severity counts as hurt.
    """
    healthy, whose = healthy_reference(clip, captured)
    side = hurt_side(skeleton, max(clip.severity_by_link, key=lambda link: clip.severity_by_link[link]))
    sizes = _rounded_values(measure_effects(profile_of_walk(clip.walk), healthy, side))
    return {"clip": clip.clip, "hurt": dict(clip.severity_by_link), "side": side, "healthy": whose, **sizes}


def limp_distance(walk: Profile, healthy: Profile, other: Profile, other_healthy: Profile) -> float:
    """How much the limps of two bodies differ. A limp is how a body's walk differs from its healthy walk.

    walk, healthy: profiles of the first body. other, other_healthy: profiles of the second body. The distance
    is the root mean square of the differences of all features of the limps. Each difference is divided by the
    standard deviation of its feature over people's walks.
    """
    spread = examples_of_people()[0].std(axis=0)
    a, b = (np.array(list(features(*pair).values())) for pair in ((walk, healthy), (other, other_healthy)))
    return float(np.sqrt(np.mean(((a - b) / spread) ** 2)))


def compare_held_out(
    network: Network,
    captured: Sequence[CapturedWalk],
    splits: Mapping[str, str],
    seconds: float,
    runtime: Runtime,
) -> list[dict[str, Any]]:
    """Whether limps in held-out clips are nearer to the hurt character than to the healthy one.

    Each clip is compared with the hurt character, which has the clip's severities, and with the healthy
    character. Both have a target speed of 1.2 m/s, a likely speed of the performer's healthy walk. Returns a
    row for each clip. `hurt`, `healthy`: the `limp_distance` of the clip from the hurt and from the healthy
    character; None if either of them does not walk a whole cycle. `nearer`: whether the hurt character is
    nearer, as it should be; False without distances.
    """
    limps = [clip for clip in captured if clip.severity_by_link and splits.get(clip.clip) == "held_out"]
    if not limps:
        return []
    figures = walk_figures(
        network, [{}, *(clip.severity_by_link for clip in limps)], SPEEDS["walk"], "walk", seconds, runtime
    )
    healthy_figure = figures[0].profile
    out = []
    for clip, figure in zip(limps, figures[1:], strict=True):
        healthy, whose = healthy_reference(clip, captured)
        row: dict[str, Any] = {
            "clip": clip.clip,
            "hurt_links": dict(clip.severity_by_link),
            "compared_with": whose,
        }
        if healthy_figure is None or figure.profile is None:
            out.append({**row, "healthy": None, "hurt": None, "nearer": False})
            continue
        walk_of_clip = profile_of_walk(clip.walk)
        from_healthy, from_hurt = (
            limp_distance(walk_of_clip, healthy, walk, healthy_figure)
            for walk in (healthy_figure, figure.profile)
        )
        out.append(
            {
                **row,
                "healthy": round(from_healthy, 5),
                "hurt": round(from_hurt, 5),
                "nearer": from_hurt < from_healthy,
            }
        )
    return out


def second_injuries(
    network: Network, links: Sequence[str], seconds: float, runtime: Runtime
) -> list[dict[str, Any]]:
    """A row with the speed of each walk with two injuries. Empty if `links` has no right thigh.

    The first injury is the right thigh at severity 5 or 10. The second is any other link at severity 5 or 10.
    `speed_share`: speed, divided by the speed of the healthy walk.
    `from_first`: speed, divided by the speed with the first injury alone. This should be at most 1, because a
    second injury must not make the walk faster.
    """
    assert network.skeleton is not None
    first = next((link for link in links if _is_part_on_side(network.skeleton, link, "thigh", "right")), None)
    if first is None:
        return []
    # (severity of the first injury, link of the second injury, its severity)
    cases = [
        (a, link, b) for a in FIRST_SEVERITIES for link in links if link != first for b in SECOND_SEVERITIES
    ]
    injuries = [{}, *({first: a} for a in FIRST_SEVERITIES), *({first: a, link: b} for a, link, b in cases)]
    figures = walk_figures(network, injuries, SPEEDS["walk"], "walk", seconds, runtime)
    healthy = max(figures[0].speed, 1e-9)
    with_first_alone = dict(zip(FIRST_SEVERITIES, figures[1:], strict=False))
    return [
        {
            "first": first,
            "first_severity": a,
            "second": link,
            "severity": b,
            "speed_share": round(figure.speed / healthy, 5),
            "from_first": round(figure.speed / max(with_first_alone[a].speed, 1e-9), 5),
        }
        for (a, link, b), figure in zip(cases, figures[1 + len(FIRST_SEVERITIES) :], strict=True)
    ]


def _is_part_on_side(skeleton: Skeleton, link: str, part: str, side: str) -> bool:
    """Whether a link belongs to a part of the body, such as "thigh", on a side."""
    found = part_of_link(skeleton, _joints_of_link(skeleton, link))
    return found.name == part and hurt_side(skeleton, link) == side


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """Measure the limps. The outcome has the content of limp.json and its tables."""
    network = load_network(inputs.weights)
    if network.skeleton is None:
        raise HobbleError(f"{inputs.weights}: this network file has no skeleton, so limps cannot be measured")
    sample = sample_to_measure(inputs, options)
    # A network without severities has no limps, so no clips are read.
    parts = clip_parts(inputs.clips, sample) if injury_links(network) else ()
    captured, hurt_seconds = captured_walks(parts, inputs.splits, injury_links(network), network.skeleton)
    result = measure_limps(
        network,
        captured,
        hurt_seconds,
        inputs.splits,
        configuration=inputs.configuration,
        runtime=inputs.runtime,
        seconds=options.limp_seconds,
    )
    tables = {name: result.get(name, []) for name in ("sizes", "trends", "named", "second", "together")}
    at_10 = next((row for row in result.get("named", []) if row["severity"] == SEVERITIES[-1]), None)
    log_line = (
        f"a limp is found in {at_10['impaired']} of the windows with a leg at severity 10"
        if at_10
        else result["reason"]
    )
    return Outcome(with_sample(result, sample), tables, log_line)
