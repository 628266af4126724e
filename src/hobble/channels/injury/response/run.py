"""Measures how a walk and a jog change while the severity of one link rises from 0 to 10 and falls again.

A link is the piece of the body between two neighbouring joints. Each link is measured.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from hobble.channels.injury.crowd_severities import injury_links, links_hurt_in_training
from hobble.channels.injury.response import Options
from hobble.channels.injury.response.cases import divided_severities, into_a_jog, second_injuries
from hobble.channels.injury.response.results import InjuryResponse, LinkResponse, Summary, SweepRow
from hobble.channels.injury.response.sweep import SEVERITIES, sweeps
from hobble.measures.measure import MeasureInputs, Outcome, Row
from hobble.measures.sample import captured_motion, sample_to_measure, with_sample
from hobble.measures.walks import SPEEDS
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.captured import Captured
from hobble.runtime.options import Runtime

INJURY = "injury"  # name of the channel
GAITS = tuple(SPEEDS)  # "walk" and "jog"
NO_SEVERITIES = "this network has no severity inputs"


def injury_response(
    network: Network,
    motion: Iterable[Captured] = (),
    *,
    configuration: str,
    runtime: Runtime,
    seconds: float,
    links: Sequence[str] | None = None,
) -> InjuryResponse:
    """The content of injury.json, whose types are in `hobble.channels.injury.response.results`.

    motion: the captured clips; their largest accelerations are compared with the character's. configuration:
    its name. seconds: time at each severity. links: the links to hurt, by default all.

    Keys of the result. applies: false for a network without severities; `reason` says so. mode: how the
    network's weights follow from the phase. trained: those of `links` that were hurt in training; all of them
    if the network was trained on healthy clips only. rows: one for each gait, link and rising severity.
    falling: one for each gait, link and falling severity. responses: one for each gait and link. second,
    into_a_jog, divided: see the functions in `hobble.channels.injury.response.cases`. summary: means over the
    links in `trained`. summary_untrained: means over the other links.
    """
    if not injury_links(network):
        return {"configuration": configuration, "applies": False, "reason": NO_SEVERITIES}
    links = list(links or injury_links(network))
    trained = [link for link in links if link in links_hurt_in_training(network)]
    rows, falling, responses = _sweeps(network, links, trained, motion, seconds, runtime)
    return {
        "configuration": configuration,
        "applies": True,
        "mode": runtime.mode,
        "seconds": seconds,
        "severities": SEVERITIES.tolist(),
        "links": links,
        "trained": trained,
        "rows": rows,
        "falling": falling,
        "responses": responses,
        "second": second_injuries(network, trained, seconds, runtime),
        "into_a_jog": into_a_jog(network, links, seconds, runtime),
        "divided": divided_severities(network, trained, seconds, runtime),
        "summary": _summary([r for r in responses if r["trained"]]),
        "summary_untrained": _summary([r for r in responses if not r["trained"]]),
    }


def _sweeps(
    network: Network,
    links: Sequence[str],
    trained: Sequence[str],
    motion: Iterable[Captured],
    seconds: float,
    runtime: Runtime,
) -> tuple[list[SweepRow], list[SweepRow], list[LinkResponse]]:
    """`rows`, `falling` and `responses` of `injury_response`."""
    captured_largest = largest_accelerations(motion, network)
    rows: list[SweepRow] = []
    falling: list[SweepRow] = []
    responses: list[LinkResponse] = []
    for sweep in sweeps(network, links, GAITS, seconds, runtime):
        gait = sweep.gait
        for figure, link in enumerate(links):
            figure_rows = sweep.rows(figure)
            rows += figure_rows[: len(SEVERITIES)]
            falling += figure_rows[len(SEVERITIES) :]
            response = sweep.response(figure, figure_rows)
            # If this link hurts in no captured motion, all captured motion in this gait is compared.
            captured = captured_largest.get((gait, link), captured_largest.get((gait, None)))
            share = round(response["largest_acceleration"] / captured, 5) if captured else None
            responses.append(
                {
                    "gait": gait,
                    "link": link,
                    "trained": link in trained,
                    **response,
                    "clip_acceleration": captured,
                    "clip_acceleration_of": (
                        "link" if (gait, link) in captured_largest else "gait" if captured else None
                    ),
                    "clip_acceleration_share": share,
                }
            )
    return rows, falling, responses


def largest_accelerations(
    motion: Iterable[Captured], network: Network
) -> dict[tuple[str, str | None], float]:
    """(gait, link) -> largest acceleration of any joint in captured motion, cm per frame squared.

    For (gait, link), only the motion in this gait in which this link hurts counts. For (gait, None), all
    motion in this gait counts, hurt and healthy.
    """
    out: dict[tuple[str, str | None], float] = {}
    for clip in motion:
        for gait in GAITS:
            in_gait = clip.gait[:, network.gaits.index(gait)] > 0.5
            # (link or None, (F,) whether a frame counts) for each key of the result.
            counted: list[tuple[str | None, Any]] = [(None, in_gait)]
            counted += [
                (link, in_gait & (clip.channels[INJURY][:, i] > 0))
                for i, link in enumerate(injury_links(network))
            ]
            for link, frames in counted:
                if np.any(frames):
                    highest = round(float(clip.acceleration[frames].max()), 5)
                    out[gait, link] = max(highest, out.get((gait, link), 0.0))
    return out


def _summary(responses: Sequence[LinkResponse]) -> dict[str, Summary]:
    """Gait -> means over `responses`, which are of several links. Empty if there are no responses."""
    out: dict[str, Summary] = {}
    for gait in GAITS:
        group = [r for r in responses if r["gait"] == gait]
        if group:
            out[gait] = {
                "spearman_from_healthy": _mean([r["spearman"]["from_healthy"] for r in group]),
                "spearman_speed": _mean([r["spearman"]["speed"] for r in group]),
                "spearman_falling_from_healthy": _mean(
                    [r["spearman_falling"]["from_healthy"] for r in group]
                ),
                "from_healthy_cm": _mean([r["from_healthy_cm"] for r in group]),
                "after_healing_cm": _mean([r["after_healing_cm"] for r in group]),
                "hysteresis_cm": _mean([r["hysteresis_cm"] for r in group]),
                "speed_share": _mean([r["speed_share"] for r in group]),
                "settle_seconds": _mean([r["settle_seconds"] for r in group]),
                "heal_seconds": _mean([r["heal_seconds"] for r in group]),
                "acceleration_share": _mean([r["acceleration_share"] for r in group]),
                "clip_acceleration_share": _mean([r["clip_acceleration_share"] for r in group]),
            }
    return out


def _mean(values: Sequence[float | None]) -> float | None:
    """The mean of the values that are not None; None if there are none."""
    known = [v for v in values if v is not None]
    return round(float(np.mean(known)), 5) if known else None


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """The content of injury.json and of the tables in injury/."""
    sample = sample_to_measure(inputs, options)
    result = injury_response(
        load_network(inputs.weights),
        captured_motion(inputs.clips, sample),
        configuration=inputs.configuration,
        runtime=inputs.runtime,
        seconds=options.seconds,
    )
    tables: dict[str, Sequence[Row]] = {
        "second": result.get("second", []),
        "into_a_jog": result.get("into_a_jog", []),
        "divided": result.get("divided", []),
        "sweep": [*result.get("rows", []), *result.get("falling", [])],
    }
    return Outcome(with_sample(result, sample), tables, str(result.get("summary", result.get("reason"))))
