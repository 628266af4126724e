"""Measures the response to injury: every link from healthy to severity 10 and back, in two gaits."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from hobble.channels.injury.crowd_severities import hurt_links
from hobble.channels.injury.crowd_severities import links as links_of
from hobble.channels.injury.response import Options
from hobble.channels.injury.response.cases import divided_severities, into_a_jog, second_injuries
from hobble.channels.injury.response.results import InjuryResponse, LinkResponse, Summary, SweepRow
from hobble.channels.injury.response.sweep import SEVERITIES, sweeps
from hobble.evaluation.captured import Captured
from hobble.evaluation.crowd import SPEEDS
from hobble.measures.clip_parts import captured_motion, sample_of, with_sample
from hobble.measures.inputs import MeasureInputs, Outcome, Row
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.options import Runtime

INJURY = "injury"  # the channel
GAITS = tuple(SPEEDS)
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
    """The content of injury.json: a sweep of each of `links` (default: all).

    motion: the captured clips, whose largest accelerations are compared with the character's. seconds: time
    at each severity. `rows`: one for each gait, link and rising severity. `falling`: one for each gait, link
    and falling severity. `responses`: one for each gait and link (see `SeveritySweep.response`). `second`,
    `into_a_jog`, `divided`: see `hobble.channels.injury.response.cases`. `trained`: the links that were hurt
    in training. `summary`: means over these. `summary_untrained`: means over the others. `applies` is false
    for a network without severities.
    """
    if not links_of(network):
        return {"configuration": configuration, "applies": False, "reason": NO_SEVERITIES}
    links = list(links or links_of(network))
    trained = [link for link in links if link in hurt_links(network)]
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
    largest = largest_accelerations(motion, network)
    rows: list[SweepRow] = []
    falling: list[SweepRow] = []
    responses: list[LinkResponse] = []
    for sweep in sweeps(network, links, GAITS, seconds, runtime):
        gait = sweep.gait
        for figure, link in enumerate(links):
            found = sweep.rows(figure)
            rows += found[: len(SEVERITIES)]
            falling += found[len(SEVERITIES) :]
            response = sweep.response(figure, found)
            clips = largest.get((gait, link), largest.get((gait, None)))
            share = round(response["largest_acceleration"] / clips, 5) if clips else None
            responses.append(
                {
                    "gait": gait,
                    "link": link,
                    "trained": link in trained,
                    **response,
                    "clip_acceleration": clips,
                    "clip_acceleration_of": "link" if (gait, link) in largest else "gait" if clips else None,
                    "clip_acceleration_share": share,
                }
            )
    return rows, falling, responses


def largest_accelerations(
    motion: Iterable[Captured], network: Network
) -> dict[tuple[str, str | None], float]:
    """(gait, link) -> largest joint acceleration (cm per frame squared) in captured motion with that injury.

    (gait, None): the largest in that gait with any injury or none.
    """
    out: dict[tuple[str, str | None], float] = {}
    for clip in motion:
        for gait in GAITS:
            going = clip.gait[:, network.gaits.index(gait)] > 0.5
            hurt: list[tuple[str | None, Any]] = [(None, going)]
            hurt += [
                (link, going & (clip.channels[INJURY][:, i] > 0)) for i, link in enumerate(links_of(network))
            ]
            for link, chosen in hurt:
                if np.any(chosen):
                    found = round(float(clip.acceleration[chosen].max()), 5)
                    out[gait, link] = max(found, out.get((gait, link), 0.0))
    return out


def _summary(responses: Sequence[LinkResponse]) -> dict[str, Summary]:
    """Gait -> means over links; {} without links."""
    out: dict[str, Summary] = {}
    for gait in GAITS:
        some = [r for r in responses if r["gait"] == gait]
        if some:
            out[gait] = {
                "spearman_from_healthy": _mean([r["spearman"]["from_healthy"] for r in some]),
                "spearman_speed": _mean([r["spearman"]["speed"] for r in some]),
                "spearman_falling_from_healthy": _mean([r["spearman_falling"]["from_healthy"] for r in some]),
                "from_healthy_cm": _mean([r["from_healthy_cm"] for r in some]),
                "after_healing_cm": _mean([r["after_healing_cm"] for r in some]),
                "hysteresis_cm": _mean([r["hysteresis_cm"] for r in some]),
                "speed_share": _mean([r["speed_share"] for r in some]),
                "settle_seconds": _mean([r["settle_seconds"] for r in some]),
                "heal_seconds": _mean([r["heal_seconds"] for r in some]),
                "acceleration_share": _mean([r["acceleration_share"] for r in some]),
                "clip_acceleration_share": _mean([r["clip_acceleration_share"] for r in some]),
            }
    return out


def _mean(values: Sequence[float | None]) -> float | None:
    known = [v for v in values if v is not None]
    return round(float(np.mean(known)), 5) if known else None


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """injury.json, and its sweeps as tables."""
    sample = sample_of(inputs, options)
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
