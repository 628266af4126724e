"""The results of one configuration, as the comparison with other configurations reads them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import yaml

from hobble.core.files import read_json
from hobble.evaluation.csv_tables import read_numbers
from hobble.evaluation.pipeline_results import Pipeline
from hobble.measures.inputs import Json


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
    pipeline: Pipeline = field(repr=False)
    history: Mapping[str, list[float | None]] = field(repr=False)

    def results_of(self, measure: str) -> Json:
        """The content of the JSON file of the measurement `measure`."""
        return self.measurements[measure]

    @property
    def dataset(self) -> str:
        """The name of the configuration's data set."""
        return self.resolved["configuration"]["dataset"]

    def stage_value(self, stage: str, key: Literal["seconds", "bytes"]) -> float | None:
        """The value `key` of a stage in pipeline.json; None if it does not list the stage."""
        return next((s[key] for s in self.pipeline["stages"] if s["stage"] == stage), None)


def read_results(name: str, files: Mapping[str, str | Path]) -> ConfigurationResults:
    """Read one configuration's results.

    files: key -> path, with the keys `configuration`, `pipeline`, `history` and the names of the
    measurements. Raises InputError, which names the file, if a JSON file or the history cannot be read.
    """
    paths = dict(files)  # after the three `pop` calls, only the files of the measurements are left
    resolved = yaml.safe_load(Path(paths.pop("configuration")).read_text(encoding="utf-8"))
    history, pipeline = read_numbers(paths.pop("history")), read_json(paths.pop("pipeline"))
    return ConfigurationResults(
        name, resolved, {key: read_json(path) for key, path in paths.items()}, pipeline, history
    )
