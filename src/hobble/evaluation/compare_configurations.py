"""Compares any number of configurations with each other and with published figures.

It calls the module `comparison.py` of each measurement. The module may have these functions:

- `compared(all_measured, published) -> SideBySide`: what it adds to compare.json (see `comparison_rows`),
- `tables(compared) -> Mapping[str, Sequence[Row]]`: name -> rows of a CSV table with the same data.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from hobble.evaluation.comparison_rows import PublishedRow, SideBySide, published_row
from hobble.evaluation.configuration_results import ConfigurationResults
from hobble.measures.inputs import Json
from hobble.measures.registry import MEASURES
from hobble.models import network_options


def compare(all_measured: Sequence[ConfigurationResults], published: Json) -> Json:
    """The content of compare.json. Configurations are in the order of `all_measured`.

    `configurations`: how they differ. `training`: their histories. `stages`: time, memory and size of their
    stages. The name of each measurement: its results. `difference`: of each pair (eq. 3.2 of Segerstedt
    2021). `against_published`: published figures next to ours. `published`: all published figures.
    `milliseconds`: what was measured with a clock, with its own `difference` and `against_published`.
    """
    found = {name: put_together(all_measured, published) for name, put_together in each("compared")}
    times = SideBySide(milliseconds={"against_published": stage_times(all_measured, published)})
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
        "against_published": [
            *(row for one in found.values() for row in one.against_published),
            *stage_sizes(all_measured, published),
        ],
        "milliseconds": {
            kind: [row for one in everything for row in one.milliseconds.get(kind, ())] for kind in clocked
        },
        "published": dict(published),
    }


def each(function: str) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield the name and the function of each measurement whose `comparison.py` has this function."""
    for one in MEASURES:
        if (found := getattr(one.part("comparison"), function, None)) is not None:
            yield one.name, found


def describe(measured: ConfigurationResults, found: Iterable[SideBySide]) -> Json:
    """A description of a configuration: data set, network, training, and what the measurements add to it."""
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
        # Motion matching has no layers and is not trained, even if the section `training` says passes.
        "passes": model["training"]["passes"] if hidden else None,
        **about,
    }


def stage_sizes(all_measured: Sequence[ConfigurationResults], published: Json) -> list[PublishedRow]:
    """Published sizes of the database and of the terrain patches, next to ours."""
    found = {m.name: m for m in all_measured}
    out = []
    for row in published["stages"]:
        m = found.get(row["configuration"])
        if row["stage"] == "database":
            database = m.pipeline.get("database") if m else None
            ours: float | None = database["bytes"] if database else None
            out.append(published_row("database", row, row["bytes"], ours, "bytes"))
        elif row["stage"] == "terrain":
            ours = m.of_stage("terrain", "bytes") if m else None
            out.append(published_row("patches", row, row["bytes"], ours, "bytes"))
    return out


def stage_times(all_measured: Sequence[ConfigurationResults], published: Json) -> list[PublishedRow]:
    """Published seconds of whole stages, next to ours."""
    found = {m.name: m for m in all_measured}
    out = []
    for row in published["stages"]:
        m = found.get(row["configuration"])
        ours = m.of_stage(row["stage"], "seconds") if m else None
        out.append(published_row(f"{row['stage']}, time", row, row["seconds"], ours, "s"))
    return out
