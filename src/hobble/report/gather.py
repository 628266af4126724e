"""Reads the files from which the report of a configuration is made, and tables of results for a notebook."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hobble.core.errors import HobbleError
from hobble.core.files import Json, read_json, read_numbers, read_yaml
from hobble.models.load import load_network
from hobble.report.parts import citation

if TYPE_CHECKING:
    import pandas

PUBLISHED = Path(__file__).with_name("published.yaml")


@dataclass(frozen=True)
class ReportMaterial:
    """The results of one configuration.

    name: of the configuration. dataset: name of the data set. title: heading of the page, if it is not the
    name. splits: clip -> "train" or "held_out". resolved: the configuration with all defaults. measurements:
    measurement -> the JSON with its results. pipeline: content of pipeline.json. history: column of the
    training history -> values, one for each section (part of a pass) of training, None for an empty cell.
    network: from `describe_network`. motion: the report on each clip's motion. labels: the report on each
    clip's labels, in the same order. channels: a report for each clip and channel. terrain_files,
    row_files: paths of the files with the clips' terrain fits and rows. published: content of published.yaml.
    measures: all measurements, for what they show (`hobble.report.templates`).
    """

    name: str
    dataset: str
    title: str | None
    splits: Mapping[str, str] = field(repr=False)
    resolved: Mapping[str, Any] = field(repr=False)
    measurements: Mapping[str, Json] = field(repr=False)
    pipeline: Json = field(repr=False)
    history: Mapping[str, list[float | None]] = field(repr=False)
    network: Mapping[str, Any] = field(repr=False)
    motion: list[dict[str, Any]] = field(repr=False)
    labels: list[dict[str, Any]] = field(repr=False)
    channels: list[dict[str, Any]] = field(repr=False)
    terrain_files: list[str] = field(repr=False)
    row_files: list[str] = field(repr=False)
    published: Mapping[str, Any] = field(repr=False)
    measures: Sequence[Any] = field(default=(), repr=False)

    def split_of(self, clip: str) -> str:
        """The split of a clip, "train" or "held_out"."""
        return self.splits.get(clip, "train")

    def results_of(self, measure: str) -> Json:
        """The results of a measurement; empty if it was not run."""
        return self.measurements.get(measure, {})

    def published_entry(self, what: str) -> Json | None:
        """The first entry for this configuration in the list `what` of published.yaml, or None."""
        rows = self.published.get(what, ())
        return next((row for row in rows if row["configuration"] == self.name), None)

    def published_records(self, *lists: str) -> list[dict[str, Any]]:
        """All entries of some lists of published.yaml as rows of a table, with `network` and `source`."""
        return [
            {"network": entry.get("label"), **entry, "source": citation(entry, self.published["sources"])}
            for name in lists
            for entry in self.published[name]
        ]


def gather(measures: Sequence[Any] = (), **given: Any) -> ReportMaterial:
    """Read the files of a report.

    measures: all measurements. given: `name`, `dataset`, `title` and `splits` as in `ReportMaterial`; and
    paths: under `configuration`, `pipeline`, `history` and `weights` one each, and under `measurements`,
    `motion`, `labels`, `channels`, `terrain` and `rows` some each. Raises InputError, which names the file,
    if one cannot be read.
    """
    return ReportMaterial(
        **{key: given[key] for key in ("name", "dataset", "title", "splits")},
        resolved=read_yaml(given["configuration"]) or {},
        measurements={Path(path).stem: read_json(path) for path in given["measurements"]},
        pipeline=read_json(given["pipeline"]),
        history=read_numbers(given["history"]),
        network=describe_network(given["weights"]),
        motion=list(map(read_json, given["motion"])),
        labels=list(map(read_json, given["labels"])),
        channels=list(map(read_json, given["channels"])),
        terrain_files=list(given["terrain"]),
        row_files=list(given["rows"]),
        published=read_yaml(PUBLISHED),
        measures=measures,
    )


def describe_network(path: str | Path) -> dict[str, Any]:
    """What the page says about the network in the file `path`.

    Keys of the result: `described`: the kind of network in words. `sizes`: of its layers, empty if it has
    none. `inputs`, `outputs`: numbers of columns of X and Y. `parameters`: their number. `bytes`: size of the
    file. `skeleton`: a dict, empty if the file has none.
    """
    network = load_network(path)
    return {
        "described": network.description,
        "sizes": list(network.sizes),
        "inputs": network.layout.x_size,
        "outputs": network.layout.y_size,
        "parameters": network.parameter_count,
        "bytes": Path(path).stat().st_size,
        "skeleton": network.meta.get("skeleton") or {},
    }


def results(configuration: str, folder: str | Path = "results") -> dict[str, pandas.DataFrame]:
    """Name -> data frame, for each table of results: of a configuration, a comparison or the publications.

    configuration: its name, "compare" for the last comparison, or "published" for published figures. folder:
    the results folder of the workflow. The tables of a configuration are those of its measurements, such as
    "accuracy/clips", and "history", with a row for each section of the training. docs/artefacts.md describes
    their columns. Raises HobbleError if there are no results yet.
    """
    import pandas  # slow, and reports do without

    if configuration == "published":
        return {name: pandas.DataFrame(rows) for name, rows in _published().items()}
    base = Path(folder) / configuration
    parts = ["tables"] if configuration == "compare" else ["evaluation", "network"]
    files = {
        str(file.relative_to(base / part).with_suffix("")): file
        for part in parts
        for file in sorted((base / part).rglob("*.csv"))
    }
    if not files:
        raise HobbleError(f"{base} has no tables. Make them: snakemake -c2 {base}/report.html")
    return {name: pandas.read_csv(file) for name, file in files.items() if file.stat().st_size}


def _published() -> dict[str, Any]:
    """Name -> rows of a table: each list of published.yaml, and each group of columns."""
    found = read_yaml(PUBLISHED)
    lists = {
        name: rows for name, rows in found.items() if isinstance(rows, list) and isinstance(rows[0], dict)
    }
    return {**lists, **{name: found[name] for name in ("clip_means", "clip_sds", "laps", "curves")}}
