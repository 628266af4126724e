"""Compares any number of configurations with each other and with published results.

The comparison becomes compare.json and CSV tables. A measurement may have a module `comparison.py` with these
functions:

- `compared(all_measured, published) -> ComparisonAddition`: what the measurement adds to compare.json,
- `tables(compared) -> Mapping[str, Sequence[Row]]`: CSV tables, table name -> rows, from the content of
  compare.json.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from hobble.evaluation.comparison_rows import ComparisonAddition, PublishedRow, published_row
from hobble.evaluation.configuration_results import ConfigurationResults
from hobble.measures.inputs import Json
from hobble.measures.registry import MEASURES
from hobble.models import network_options


def compare_configurations(all_measured: Sequence[ConfigurationResults], published: Json) -> Json:
    """The content of compare.json. Configurations are in the order of `all_measured`.

    published: the content of published.yaml. Keys of the result: `configurations`: a description of each.
    `training`: the history of each training. `stages`: time, memory and size of each stage of the workflow.
    The name of each measurement: its results. `difference`: how much each two configurations differ (eq. 3.2
    of Segerstedt 2021). `against_published`: published numbers next to ours. `published`: all published
    numbers. `milliseconds`: what was measured with a clock, with its own `difference` and
    `against_published`.
    """
    by_measure = {
        name: compared(all_measured, published) for name, compared in comparison_functions("compared")
    }
    times = ComparisonAddition(milliseconds={"against_published": stage_times(all_measured, published)})
    additions = [*by_measure.values(), times]
    clock_keys = dict.fromkeys(
        key for added in additions for key in added.milliseconds
    )  # each once, in order
    return {
        "configurations": [describe_configuration(m, by_measure.values()) for m in all_measured],
        **{name: list(added.entries) for name, added in by_measure.items()},
        "training": [{"configuration": m.name, **m.history} for m in all_measured],
        "stages": [
            {"configuration": m.name, **{k: v for k, v in stage.items() if k != "rules"}}
            for m in all_measured
            for stage in m.pipeline["stages"]
        ],
        "difference": [row for added in by_measure.values() for row in added.differences],
        "against_published": [
            *(row for added in by_measure.values() for row in added.against_published),
            *stage_sizes(all_measured, published),
        ],
        "milliseconds": {
            key: [row for added in additions for row in added.milliseconds.get(key, ())] for key in clock_keys
        },
        "published": dict(published),
    }


def comparison_functions(name: str) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield (name of a measurement, function `name` of its `comparison.py`), for those that have it."""
    for measure in MEASURES:
        if (function := getattr(measure.import_module("comparison"), name, None)) is not None:
            yield measure.name, function


def describe_configuration(results: ConfigurationResults, additions: Iterable[ComparisonAddition]) -> Json:
    """A configuration's entry in compare.json: data set, network, training, and what measurements add."""
    configuration = results.resolved["configuration"]
    hidden = network_options(configuration["network"]).hidden
    about = {key: value for added in additions for key, value in added.about.get(results.name, {}).items()}
    return {
        "configuration": results.name,
        "dataset": results.dataset,
        "network_of": configuration.get("network_of"),
        "channels": list(configuration.get("channels") or ()),
        "hidden_layers": len(hidden) or None,
        "units": max(hidden, default=None),
        # Motion matching has no layers and is not trained, even if the section `training` has passes.
        "passes": configuration["training"]["passes"] if hidden else None,
        **about,
    }


def stage_sizes(all_measured: Sequence[ConfigurationResults], published: Json) -> list[PublishedRow]:
    """Published sizes of the database and of the terrain patches, next to ours. Sizes are in bytes."""
    by_name = {m.name: m for m in all_measured}
    out = []
    for row in published["stages"]:
        m = by_name.get(row["configuration"])
        if row["stage"] == "database":
            database = m.pipeline.get("database") if m else None
            ours: float | None = database["bytes"] if database else None
            out.append(published_row("database", row, row["bytes"], ours, "bytes"))
        elif row["stage"] == "terrain":
            ours = m.stage_value("terrain", "bytes") if m else None
            out.append(published_row("patches", row, row["bytes"], ours, "bytes"))
    return out


def stage_times(all_measured: Sequence[ConfigurationResults], published: Json) -> list[PublishedRow]:
    """Published times of whole stages of the workflow, in seconds, next to ours."""
    by_name = {m.name: m for m in all_measured}
    out = []
    for row in published["stages"]:
        m = by_name.get(row["configuration"])
        ours = m.stage_value(row["stage"], "seconds") if m else None
        out.append(published_row(f"{row['stage']}, time", row, row["seconds"], ours, "s"))
    return out
