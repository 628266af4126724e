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
    """The inputs of a measurement of one configuration. Those that its `Measure` does not ask for are empty.

    configuration: its name. files: name of an input -> its file, such as the network or the JSON of another
    measurement. clips: clip -> its file of rows. splits: clip -> "train" or "held_out". people: clip -> the
    person who walks in it. If the person is not known, the clip, its mirror and the hurt clips made from it
    count as one more person. summaries: the `hobble.rows.summary` file of each clip. runtime: the values of
    the keys in `Measure.runtime`; the other keys have defaults. pieces: if the measurement was split into
    pieces that ran as jobs of their own, name of a piece -> its JSON file.
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
        """The file of the input `name`. Raises HobbleError if the measurement's `inputs` do not list it."""
        if name not in self.files:
            raise HobbleError(
                f"A measurement reads the input {name!r}, which its `Measure` does not list. "
                "Add it to `inputs`."
            )
        return self.files[name]

    @property
    def weights(self) -> Path:
        """The network's file."""
        return self.file("weights")

    @property
    def skeleton(self) -> Json:
        """The data set's skeleton: the content of config/skeletons/<name>.yaml."""
        return read_yaml(self.file("skeleton")) or {}

    @property
    def published(self) -> Json:
        """The content of published.yaml: published results with which ours are compared."""
        return yaml.safe_load(self.file("published").read_text(encoding="utf-8"))

    def measured_pieces(self) -> dict[str, Json]:
        """Name of a piece -> its result, for each piece that ran as a job of its own."""
        return {name: read_json(path) for name, path in self.pieces.items()}

    def results_of(self, name: str) -> Json:
        """The content of the JSON file of another measurement."""
        return read_json(self.file(name))


@dataclass(frozen=True)
class Outcome:
    """The output of a measurement.

    result: the content of <measure>.json. tables: name -> rows of <measure>/<name>.csv. log_line: a line for
    the log.
    """

    result: Json = field(repr=False)
    tables: Mapping[str, Sequence[Row]] = field(default_factory=dict, repr=False)
    log_line: str = ""
