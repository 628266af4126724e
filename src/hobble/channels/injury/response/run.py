"""Measures the response to injury: every link from healthy to severity 10 and back, in two gaits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from hobble.channels.injury.response import Options
from hobble.channels.injury.response.cases import divided_severities, into_a_jog, second_injuries
from hobble.channels.injury.response.sweep import SEVERITIES, sweeps
from hobble.channels.injury.walks import hurt_links
from hobble.channels.injury.walks import links as links_of
from hobble.evaluation.captured import Captured
from hobble.evaluation.crowd import SPEEDS
from hobble.measures.chosen import captured_motion, sample_of, with_sample
from hobble.measures.given import Given, Outcome
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.options import Runtime

INJURY = "injury"  # the channel
GAITS = tuple(SPEEDS)
NO_SEVERITIES = "this network has no severity inputs"
SUMMARY = (
    "from_healthy_cm",
    "after_healing_cm",
    "hysteresis_cm",
    "speed_share",
    "settle_seconds",
    "heal_seconds",
    "acceleration_share",
    "clip_acceleration_share",
)


def injury_response(
    network: Network,
    motion: Iterable[Captured] = (),
    *,
    configuration: str,
    runtime: Runtime,
    seconds: float,
    links: Sequence[str] | None = None,
) -> dict[str, Any]:
    """The content of injury.json: a sweep of each of `links` (default: all).

    motion: the captured clips, whose largest accelerations are compared with the character's. seconds: time
    at each severity. `rows`: one for each gait, link and rising severity. `falling`: the same for falling
    severity. `responses`: for each gait and link (see `Sweep.response`). `second`, `into_a_jog`, `divided`:
    see `cases`. `summary`: means over the links that were hurt in training (`trained`) and over the others.
    `applies` is false for a network without severities.
    """
    if not links_of(network):
        return {"configuration": configuration, "applies": False, "reason": NO_SEVERITIES}
    links = list(links or links_of(network))
    trained = [link for link in links if link in hurt_links(network)]
    largest = largest_accelerations(motion, network)
    rows: list[dict[str, Any]] = []
    falling: list[dict[str, Any]] = []
    responses = []
    for sweep in sweeps(network, links, GAITS, seconds, runtime):
        gait = sweep.gait
        for figure, link in enumerate(links):
            found = sweep.rows(figure)
            rows += found[: len(SEVERITIES)]
            falling += found[len(SEVERITIES) :]
            response = sweep.response(figure, found)
            clips = largest.get((gait, link), largest.get((gait, None)))
            responses.append(
                {
                    "gait": gait,
                    "link": link,
                    "trained": link in trained,
                    **response,
                    "clip_acceleration": clips,
                    "clip_acceleration_of": "link" if (gait, link) in largest else "gait" if clips else None,
                    "clip_acceleration_share": round(response["largest_acceleration"] / clips, 5)
                    if clips
                    else None,
                }
            )
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


def largest_accelerations(
    motion: Iterable[Captured], network: Network
) -> dict[tuple[str, str | None], float]:
    """(gait, link) -> largest joint acceleration (cm per frame squared) in captured motion.

    (gait, None): the largest in that gait with any or no injury.
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


def _summary(responses: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Means over links, by gait; {} without links."""
    out = {}
    for gait in GAITS:
        some = [r for r in responses if r["gait"] == gait]
        if some:
            out[gait] = {
                "spearman_from_healthy": _mean([r["spearman"]["from_healthy"] for r in some]),
                "spearman_speed": _mean([r["spearman"]["speed"] for r in some]),
                "spearman_falling_from_healthy": _mean([r["spearman_falling"]["from_healthy"] for r in some]),
                **{key: _mean([r[key] for r in some]) for key in SUMMARY},
            }
    return out


def _mean(values: Sequence[float | None]) -> float | None:
    known = [v for v in values if v is not None]
    return round(float(np.mean(known)), 5) if known else None


def run(given: Given, options: Options) -> Outcome:
    """injury.json, and its sweeps as tables."""
    sample = sample_of(given, options)
    result = injury_response(
        load_network(given.weights),
        captured_motion(given.clips, sample),
        configuration=given.configuration,
        runtime=given.runtime,
        seconds=options.seconds,
    )
    tables = {name: result.get(name, []) for name in ("second", "into_a_jog", "divided")}
    tables["sweep"] = [*result.get("rows", []), *result.get("falling", [])]
    return Outcome(with_sample(result, sample), tables, str(result.get("summary", result.get("reason"))))
