"""Compares any number of configurations with each other and with published results."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from hobble.core.files import Json, read_json, read_numbers
from hobble.measures.measure import Row, flatten, functions
from hobble.models import network_options


def difference_in_sds(a: Sequence[float], b: Sequence[float]) -> float | None:
    """The difference of the means of two samples, in units of the mean of their standard deviations (n - 1).

    This is 2 |mean of a - mean of b| / (sd of a + sd of b), equation 3.2 of Segerstedt 2021. None if a sample
    has fewer than two values, or both standard deviations are 0.

    >>> difference_in_sds([2.0, 4.0], [0.0, 0.0])
    4.242640687119285
    """
    if min(len(a), len(b)) < 2:
        return None
    spread = np.std(a, ddof=1) + np.std(b, ddof=1)
    return float(2 * abs(np.mean(a) - np.mean(b)) / spread) if spread else None


def fit_line(x: Sequence[float], y: Sequence[float]) -> dict[str, float | None]:
    """The least-squares line y = intercept + slope x through points; None if x has fewer than two values."""
    slope, intercept = map(float, np.polyfit(x, y, 1)) if len(set(x)) > 1 else (None, None)
    return {"slope": slope, "intercept": intercept}


@dataclass(frozen=True)
class ConfigurationResults:
    """The results of one configuration.

    name: the configuration's name. resolved: the content of its configuration.yaml: all keys of the
    configuration and of its data set, also those with default values. measurements: name of a measurement ->
    the content of its JSON file. pipeline: the content of pipeline.json: time, memory and size of each stage
    of the workflow. history: the content of history.csv, column -> a value for each pass of the training,
    None for an empty field.
    """

    name: str
    resolved: Json = field(repr=False)
    measurements: Mapping[str, Json] = field(repr=False)
    pipeline: Json = field(repr=False)
    history: Mapping[str, list[float | None]] = field(repr=False)

    def results_of(self, measure: str) -> Json:
        """The content of the JSON file of a measurement; `applies` is false if it was not made."""
        return self.measurements.get(measure, {"applies": False})

    @property
    def dataset(self) -> str:
        """The name of the configuration's data set."""
        return self.resolved["configuration"]["dataset"]

    def stage_value(self, stage: str, key: str) -> float | None:
        """The value "seconds" or "bytes" of a stage in pipeline.json; None if it does not list the stage.

        The bytes of the database are those of its rows, without reports on the clips.
        """
        if (stage, key) == ("database", "bytes"):
            return (self.pipeline.get("database") or {}).get("bytes")
        return next((s[key] for s in self.pipeline["stages"] if s["stage"] == stage), None)


def read_results(
    name: str, configuration: str, pipeline: str, history: str, measurements: Sequence[str]
) -> ConfigurationResults:
    """Read one configuration's results. All arguments but its name are paths.

    Raises InputError, which names the file, if a JSON file or the history cannot be read.
    """
    resolved = yaml.safe_load(Path(configuration).read_text(encoding="utf-8"))
    by_name = {Path(path).stem: read_json(path) for path in measurements}
    return ConfigurationResults(name, resolved, by_name, read_json(pipeline), read_numbers(history))


@dataclass(frozen=True)
class ComparisonAddition:
    """What one measurement adds to compare.json.

    entries: the results of each configuration, under the measurement's name. about: configuration -> entries
    to add to its description. differences: rows of `pair_differences`. against_published: rows of
    `published_row`. milliseconds: what was measured with a clock, key -> rows. `difference` and
    `against_published` are such keys, and a measurement may have others.
    """

    entries: Sequence[Json] = field(default=(), repr=False)
    about: Mapping[str, Json] = field(default_factory=dict, repr=False)
    differences: Sequence[Row] = field(default=(), repr=False)
    against_published: Sequence[Row] = field(default=(), repr=False)
    milliseconds: Mapping[str, Sequence[Row]] = field(default_factory=dict, repr=False)


def pair_differences(means: Mapping[str, Mapping[str, Sequence[float]]]) -> list[dict[str, Any]]:
    """How much each two configurations differ in each thing that both measured, see `difference_in_sds`.

    means: configuration -> split or phase mode -> the mean of each clip or lap.
    """
    return [
        {"a": a, "b": b, "over": over, "difference": difference_in_sds(of_a, means[b][over])}
        for a, b in combinations(means, 2)
        for over, of_a in means[a].items()
        if of_a and means[b].get(over)
    ]


def published_row(
    measure: str, row: Json, theirs: float, ours: float | None, unit: str = ""
) -> dict[str, Any]:
    """A published number (`theirs`) next to ours, which is None if it was not measured.

    measure: what was measured, in words. row: the entry of published.yaml. It has `configuration` and
    `source`. It may have `table`, the number of the table that printed the value, and `other_figure` or
    `slip`, a text with a different value from the same publication, or that follows from it.
    """
    return {
        "measure": measure,
        "configuration": row["configuration"],
        "unit": unit,
        "published": theirs,
        "ours": ours,
        "source": row["source"],
        "table": row.get("table"),
        "other_figure": row.get("other_figure", row.get("slip")),
    }


def beside_ours(
    measure: str, rows: Iterable[Json], key: str, ours: Mapping[str, float | None], unit: str = ""
) -> list[dict[str, Any]]:
    """The `published_row` of each of `rows`, entries of published.yaml with their number under `key`.

    ours: configuration -> our number. Configurations that we did not measure may be missing.
    """
    return [published_row(measure, row, row[key], ours.get(row["configuration"]), unit) for row in rows]


def published_clips(published: Json) -> list[str]:
    """The names of the 80 clips of Tables A.4 and A.5 of Segerstedt (2021), as our files have them."""
    return [f"{clip}{end}" for clip in published["clips"] for end in ("", "_mirror")]


def compare_configurations(all_measured: Sequence[ConfigurationResults], published: Json) -> Json:
    """The content of compare.json. Configurations are in the order of `all_measured`.

    published: the content of published.yaml. Keys of the result: `configurations`: a description of each.
    `training`: the history of each training. `stages`: time, memory and size of each stage of the workflow.
    The name of each measurement: its results. `difference`: how much each two configurations differ (eq. 3.2
    of Segerstedt 2021). `against_published`: published numbers next to ours. `published`: all published
    numbers. `milliseconds`: what was measured with a clock, with its own `difference` and
    `against_published`.
    """
    by_measure = {name: compared(all_measured, published) for name, compared in functions("compared")}
    costs = published_costs(all_measured, published)
    additions = [*by_measure.values(), costs]
    clock_keys = dict.fromkeys(key for added in additions for key in added.milliseconds)
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
        "against_published": [row for added in additions for row in added.against_published],
        "milliseconds": {
            key: [row for added in additions for row in added.milliseconds.get(key, ())] for key in clock_keys
        },
        "published": dict(published),
    }


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


def published_costs(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """Published bytes and seconds of whole stages of the workflow, next to ours.

    The bytes of the training are those of the network's weights, which `responsivity` compares.
    """
    by_name = {m.name: m for m in all_measured}
    rows: dict[str, list[Row]] = {"bytes": [], "s": []}
    for row in published["stages"]:
        m, stage = by_name.get(row["configuration"]), row["stage"]
        for key, unit, what in (("bytes", "bytes", row.get("what")), ("seconds", "s", f"{stage}, time")):
            if key in row and (stage, key) != ("training", "bytes"):
                ours = m.stage_value(stage, key) if m else None
                rows[unit].append(published_row(what, row, row[key], ours, unit))
    return ComparisonAddition(against_published=rows["bytes"], milliseconds={"against_published": rows["s"]})


def published_differences(over: str, rows: Sequence[Json], published: Json) -> list[dict[str, Any]]:
    """Published values of eq. 3.2 next to ours, from the means of clips or laps.

    over: key of published.yaml, "error" or "milliseconds". rows: ours, of the training clips or of the phase
    mode `constant`.
    """
    ours = {
        f"{a} to {b}": row["difference"]
        for row in rows
        for a, b in ((row["a"], row["b"]), (row["b"], row["a"]))
    }
    theirs = [
        {**row, "configuration": f"{row['a']} to {row['b']}"}
        for row in published["differences"]
        if row["over"] == over
    ]
    return beside_ours(f"eq. 3.2, {over}", theirs, "value", ours)


def comparison_tables(compared: Json) -> dict[str, Sequence[Row]]:
    """Table name -> rows, from the content of compare.json. A row may lack columns that others have."""
    measure_tables = {
        name: rows for _, make_tables in functions("tables") for name, rows in make_tables(compared).items()
    }
    return {
        "configurations": [flatten(row) for row in compared["configurations"]],
        **measure_tables,
        "training": [
            {key: value if key == "configuration" else value[i] for key, value in of.items()}
            for of in compared["training"]
            for i in range(len(of.get("pass", ())))
        ],
        "stages": list(compared["stages"]),
        "difference": [
            {"measure": measure, **row}
            for measure, rows in (
                ("relative error", compared["difference"]),
                ("milliseconds a frame", compared["milliseconds"].get("difference", ())),
            )
            for row in rows
        ],
        "published": [*compared["against_published"], *compared["milliseconds"]["against_published"]],
    }
