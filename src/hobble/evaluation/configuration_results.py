"""The results of one configuration, which are compared with those of other configurations."""

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

    resolved: the content of configuration.yaml. measured: name of a measurement -> the content of its JSON
    file. pipeline: the content of pipeline.json. history: column -> values of history.csv, None for empty
    fields.
    """

    name: str
    resolved: Json = field(repr=False)
    measured: Mapping[str, Json] = field(repr=False)
    pipeline: Pipeline = field(repr=False)
    history: Mapping[str, list[float | None]] = field(repr=False)

    def found(self, measure: str) -> Json:
        """The content of the JSON file of the measurement `measure`."""
        return self.measured[measure]

    @property
    def dataset(self) -> str:
        """The name of the configuration's data set."""
        return self.resolved["configuration"]["dataset"]

    def of_stage(self, stage: str, key: Literal["seconds", "bytes"]) -> float | None:
        """The value `key` of a stage in pipeline.json; None if it does not list the stage."""
        return next((s[key] for s in self.pipeline["stages"] if s["stage"] == stage), None)


def read_results(name: str, files: Mapping[str, str | Path]) -> ConfigurationResults:
    """Read one configuration's results.

    files: paths of the files `configuration`, `pipeline`, `history`, and of one for each measurement. Raises
    InputError, which names the file, if a JSON file or the history cannot be read.
    """
    paths = dict(files)
    resolved = yaml.safe_load(Path(paths.pop("configuration")).read_text(encoding="utf-8"))
    history, pipeline = read_numbers(paths.pop("history")), read_json(paths.pop("pipeline"))
    return ConfigurationResults(
        name, resolved, {key: read_json(path) for key, path in paths.items()}, pipeline, history
    )
