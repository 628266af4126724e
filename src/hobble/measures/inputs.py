"""The inputs and outputs of a measurement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from hobble.core.errors import HobbleError
from hobble.core.files import read_json
from hobble.core.untrusted import read_yaml
from hobble.runtime.options import Runtime

Json = Mapping[str, Any]  # what a JSON file holds
Row = Mapping[str, object]  # a row of a CSV table: column -> number, text or None


@dataclass(frozen=True)
class MeasureInputs:
    """The inputs of a measurement of one configuration. It gets only those that its `Measure` asks for.

    clips: clip -> its file of rows. summaries: a `hobble.rows.summary` file for each clip. splits: clip ->
    "train" or "held_out". people: clip -> the person who walks in it; a clip whose person is not known
    counts, with its mirror and its hurt versions, as one more person. runtime: the values of the keys in
    `Measure.runtime`; the other keys have defaults. pieces: name of a piece -> its JSON file, if the pieces
    ran as separate jobs. files: name -> file of each other input, such as the JSON of another measurement.
    """

    configuration: str
    files: Mapping[str, Path] = field(default_factory=dict, repr=False)
    clips: Mapping[str, Path] = field(default_factory=dict, repr=False)
    splits: Mapping[str, str] = field(default_factory=dict, repr=False)
    people: Mapping[str, str] = field(default_factory=dict, repr=False)
    summaries: Sequence[Path] = field(default=(), repr=False)
    runtime: Runtime = field(default_factory=Runtime)
    pieces: Mapping[str, Path] = field(default_factory=dict, repr=False)

    def file(self, name: str) -> Path:
        """The file of the input `name`. Raises HobbleError if it is not among the measurement's `inputs`."""
        if name not in self.files:
            raise HobbleError(f"a measurement reads {name!r}: list it in the `inputs` of its `Measure`")
        return self.files[name]

    @property
    def weights(self) -> Path:
        """The network's file."""
        return self.file("weights")

    @property
    def skeleton(self) -> Json:
        """The data set's skeleton, as config/skeletons/<name>.yaml holds it."""
        return read_yaml(self.file("skeleton")) or {}

    @property
    def published(self) -> Json:
        """The published results with which ours are compared."""
        return yaml.safe_load(self.file("published").read_text(encoding="utf-8"))

    def measured_pieces(self) -> dict[str, Json]:
        """Name -> result of each piece that ran as a job of its own."""
        return {name: read_json(path) for name, path in self.pieces.items()}

    def measured(self, name: str) -> Json:
        """The JSON of another measurement."""
        return read_json(self.file(name))


@dataclass(frozen=True)
class Outcome:
    """The output of a measurement. `result` becomes <measure>.json, each of `tables` <measure>/<table>.csv.

    says: a line for the log.
    """

    result: Json = field(repr=False)
    tables: Mapping[str, Sequence[Row]] = field(default_factory=dict, repr=False)
    says: str = ""
