"""Any number of configurations side by side, and the published figures beside them.

What each configuration measured of itself is gathered, and each measurement says what there is to compare.
Its `comparison.py` may have

- `compared(all_measured, published) -> SideBySide`: what it adds to compare.json (see `side_by_side`),
- `tables(compared) -> Mapping[str, Sequence[Row]]`: CSV tables of that, by name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from hobble.evaluation.configuration_results import ConfigurationResults
from hobble.evaluation.side_by_side import SideBySide, published_row
from hobble.measures.given import Json
from hobble.measures.registry import MEASURES
from hobble.models import network_options


def compare(all_measured: Sequence[ConfigurationResults], published: Json) -> dict[str, Any]:
    """compare.json: lists with an entry for each configuration, in their order.

    `configurations`: what sets each apart; `training`, `stages`: how it came about; under the name of each
    measurement: what it found; `difference`: eq. 3.2 of each pair; `beside`: the published figures with
    ours; `published`: all of them. Whatever a clock decides stands under `milliseconds`: `difference` and
    `beside` again, and what else the measurements have of it.
    """
    found = {name: say(all_measured, published) for name, say in each("compared")}
    times = SideBySide(milliseconds={"beside": stage_times(all_measured, published)})
    everything = [*found.values(), times]
    clocked = dict.fromkeys(kind for one in everything for kind in one.milliseconds)
    return {
        "configurations": [describe(m, found.values()) for m in all_measured],
        **{name: list(one.entries) for name, one in found.items()},
        "training": [{"configuration": m.name, **m.history} for m in all_measured],
        "stages": [
            {"configuration": m.name, **{k: v for k, v in stage.items() if k != "rules"}}
            for m in all_measured
            for stage in m.pipeline["stages"]
        ],
        "difference": [row for one in found.values() for row in one.differences],
        "beside": [
            *(row for one in found.values() for row in one.beside),
            *stage_sizes(all_measured, published),
        ],
        "milliseconds": {
            kind: [row for one in everything for row in one.milliseconds.get(kind, ())] for kind in clocked
        },
        "published": dict(published),
    }


def each(function: str) -> Iterator[tuple[str, Callable[..., Any]]]:
    """The name of each measurement whose `comparison.py` has this function, and the function."""
    for one in MEASURES:
        if (found := getattr(one.part("comparison"), function, None)) is not None:
            yield one.name, found


def describe(measured: ConfigurationResults, found: Iterable[SideBySide]) -> dict[str, Any]:
    """What sets a configuration apart: its data, network, training, and what the measurements say of it."""
    model = measured.resolved["configuration"]
    hidden = network_options(model["network"]).hidden
    about = {key: value for one in found for key, value in one.about.get(measured.name, {}).items()}
    return {
        "configuration": measured.name,
        "dataset": measured.dataset,
        "network_of": model.get("network_of"),
        "channels": list(model.get("channels") or ()),
        "hidden_layers": len(hidden) or None,
        "units": max(hidden, default=None),
        "passes": model["training"]["passes"],
        **about,
    }


def stage_sizes(all_measured: Sequence[ConfigurationResults], published: Json) -> list[dict[str, Any]]:
    """Published bytes of the database and of the patches, with ours."""
    found = {m.name: m for m in all_measured}
    out = []
    for row in published["stages"]:
        m = found.get(row["configuration"])
        if row["stage"] == "database":
            ours = (m.pipeline.get("database") or {}).get("bytes") if m else None
            out.append(published_row("database", row, row["bytes"], ours, "bytes"))
        elif row["stage"] == "terrain":
            ours = m.of_stage("terrain", "bytes") if m else None
            out.append(published_row("patches", row, row["bytes"], ours, "bytes"))
    return out


def stage_times(all_measured: Sequence[ConfigurationResults], published: Json) -> list[dict[str, Any]]:
    """Published seconds of whole stages, with ours."""
    found = {m.name: m for m in all_measured}
    out = []
    for row in published["stages"]:
        m = found.get(row["configuration"])
        ours = m.of_stage(row["stage"], "seconds") if m else None
        out.append(published_row(f"{row['stage']}, time", row, row["seconds"], ours, "s"))
    return out
