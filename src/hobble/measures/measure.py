"""What a measurement is, what it is given and what it returns.

The module `hobble.measures.<name>` holds MEASURE and may define these functions, all optional:

- `section(found, material) -> PageSection`: its part of the report,
- `figures(found, material) -> Iterable[KeyFigure]`: key figures for the top of the report,
- `hints(found, material) -> Iterable[Hint]`: advice that follows from its numbers,
- `compared(all_measured, published) -> ComparisonAddition`: what it adds to compare.json,
- `tables(compared) -> Mapping[str, Sequence[Row]]`: CSV tables of the comparison, name -> rows,
- `compared_section(compared) -> PageSection`: its part of the comparison page,
- `compared_values(compared) -> Iterable[ComparedValue]`: columns of the table of configurations there, and
  verdicts on which configuration is best.

`found` is the measurement's JSON ({} if it was not run), `material` has all results of the configuration
(`hobble.report.gather.ReportMaterial`), `compared` is the content of compare.json, and `all_measured` has the
results of each configuration (`hobble.measures.compare`).

The module `hobble.measures.<name>_run` has `run(inputs, options) -> Outcome`.
"""

import functools
import importlib
import pkgutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import yaml
from pydantic import Field, create_model

from hobble.core.files import Json, read_json, read_yaml
from hobble.core.section import Section
from hobble.runtime import Runtime

Row = Mapping[str, object]  # a row of a CSV table: column -> number, text or None

# Names of inputs: the network, the rows of the clips, summaries of these rows, the skeleton, and published
# results. A measurement may also read the JSON of another measurement. This input has the name of the other.
INPUTS = ("weights", "clips", "summaries", "skeleton", "published")
SPLITS = ("train", "held_out")


class SampleOptions(Section):
    """The configuration key that all measurements of clips have (see `hobble.measures.sample`)."""

    sample_frames: int = Field(
        500_000,
        gt=0,
        description="about how many frames are measured at most; if the clips have more, a random sample of "
        "excerpts is drawn, half of it from held-out clips",
    )


@dataclass(frozen=True)
class Cost:
    """Memory and time that the job of a measurement requests on a cluster.

    memory_mb: MB that it needs in any case. mb_per_1000_frames: MB that it needs in addition for each
    thousand frames of the longest clip. seconds_per_1000_frames: for each thousand frames of all clips
    together. These two are for 31 joints and grow in proportion to the number of joints. least_minutes: the
    least time that is requested.
    """

    memory_mb: float = 0.0
    mb_per_1000_frames: float = 0.0
    seconds_per_1000_frames: float = 0.0
    least_minutes: int = 10


@dataclass(frozen=True)
class Measure:
    """A measurement. Its JSON file and its folder of tables have its `name`, too.

    module: full name of the module that holds it (`__name__`). inputs: what it reads, as names of INPUTS or
    of other measurements. options: the model of its keys in a configuration's section `evaluation`. runtime:
    the keys of the section `runtime` that it depends on. channel: it is only made for configurations with
    this channel; "": for all. people: whether it has to know who walks in which clip. cost: what its job
    requests on a cluster.
    """

    name: str
    module: str
    inputs: tuple[str, ...]
    options: type[Section] = Section
    runtime: tuple[str, ...] = ()
    channel: str = ""
    people: bool = False
    cost: Cost = Cost()

    @property
    def run_module(self) -> str:
        """Full name of the module that measures."""
        return f"{self.module}_run"

    def runner(self) -> ModuleType:
        """The module with `run`."""
        return importlib.import_module(self.run_module)

    def function(self, name: str) -> Callable[..., Any] | None:
        """One of the optional functions (see the top of this file); None if it does not have it."""
        return getattr(importlib.import_module(self.module), name, None)


@functools.cache
def all_measures() -> tuple[Measure, ...]:
    """All measurements, sorted by name: each module of this folder beside which there is a `<name>_run.py`.

    They are imported here, so that the job of one measurement does not depend on the others' code.
    """
    package = __name__.rpartition(".")[0]
    here = {module.name for module in pkgutil.iter_modules(importlib.import_module(package).__path__)}
    names = sorted(name for name in here if f"{name}_run" in here)
    return tuple(importlib.import_module(f"{package}.{name}").MEASURE for name in names)


def measure_named(name: str) -> Measure:
    """The measurement with this name. Raises StopIteration if there is none."""
    return next(entry for entry in all_measures() if entry.name == name)


def functions(name: str) -> Iterator[tuple[str, Callable[..., Any]]]:
    """(name of a measurement, its function `name`), for each measurement that has this function."""
    for measure in all_measures():
        if (function := measure.function(name)) is not None:
            yield measure.name, function


def joined_options(sections: Sequence[type[Section]]) -> type[Section]:
    """A section class that has the keys of all `sections`.

    Raises TypeError if two of the classes define the same key, unless they inherit it from the same base.
    """
    defined_in: dict[str, type] = {}  # key -> the class that defines it
    for section in sections:
        for key in section.model_fields:
            # The last class in the order of inheritance: an inherited key counts as the base's.
            definer = [c for c in section.__mro__ if key in getattr(c, "model_fields", {})][-1]
            if defined_in.setdefault(key, definer) is not definer:
                first, second = defined_in[key].__module__, definer.__module__
                raise TypeError(f"{key} is a key of {first} and of {second}: rename one of them")
    unique = list(dict.fromkeys(sections))
    # Leave out a class from which another inherits. Python refuses it as a base in front of that other class.
    bases = [s for s in unique if not any(other is not s and issubclass(other, s) for other in unique)]
    # Reversed, because pydantic puts the fields of the last base first.
    return create_model("Evaluation", __base__=tuple(bases[::-1]) or Section, __doc__="The measurements.")


@dataclass(frozen=True)
class MeasureInputs:
    """The inputs of a measurement of one configuration. Those that its `Measure` does not ask for are empty.

    configuration: its name. files: name of an input -> its file, such as the network or the JSON of another
    measurement. clips: clip -> its file of rows. splits: clip -> "train" or "held_out". people: clip -> the
    person who walks in it. If the person is not known, the clip, its mirror and the hurt clips made from it
    count as one more person. summaries: the `hobble.rows.clip_rows` file of each clip. runtime: the values of
    the keys in `Measure.runtime`; the other keys have defaults.
    """

    configuration: str
    files: Mapping[str, Path] = field(default_factory=dict, repr=False)
    clips: Mapping[str, Path] = field(default_factory=dict, repr=False)
    splits: Mapping[str, str] = field(default_factory=dict, repr=False)
    people: Mapping[str, str] = field(default_factory=dict, repr=False)
    summaries: Sequence[Path] = field(default=(), repr=False)
    runtime: Runtime = field(default_factory=Runtime)

    @property
    def weights(self) -> Path:
        """The network's file."""
        return self.files["weights"]

    @property
    def skeleton(self) -> Json:
        """The data set's skeleton: the content of config/skeletons/<name>.yaml."""
        return read_yaml(self.files["skeleton"]) or {}

    @property
    def published(self) -> Json:
        """The content of published.yaml: published results with which ours are compared."""
        return yaml.safe_load(self.files["published"].read_text(encoding="utf-8"))

    def results_of(self, name: str) -> Json:
        """The content of the JSON file of another measurement."""
        return read_json(self.files[name])


@dataclass(frozen=True)
class Outcome:
    """The output of a measurement.

    result: the content of <measure>.json. tables: name -> rows of <measure>/<name>.csv. log_line: a line for
    the log.
    """

    result: Json = field(repr=False)
    tables: Mapping[str, Sequence[Row]] = field(default_factory=dict, repr=False)
    log_line: str = ""


def flatten(row: Row) -> dict[str, object]:
    """The row without mappings as values: the entry `b` of a mapping under the key `a` gets the key `a_b`.

    >>> flatten({"lap": 1, "ms": {"total": 0.5, "sd": {"total": 0.1}}})
    {'lap': 1, 'ms_total': 0.5, 'ms_sd_total': 0.1}
    """
    out: dict[str, object] = {}
    for key, value in row.items():
        if isinstance(value, Mapping):
            out |= {f"{key}_{k}": v for k, v in flatten(value).items()}
        else:
            out[key] = value
    return out


def flat_rows(entries: Iterable[Json], items: str, *labels: str) -> list[Row]:
    """A table of JSON: a row for each item of the list `items` of each entry, after the entry's `labels`."""
    return [
        flatten({**{label: entry[label] for label in labels}, **item})
        for entry in entries
        for item in entry[items]
    ]


def mean_and_sd(values: Sequence[float]) -> tuple[float | None, float | None]:
    """Mean and standard deviation (n - 1) of a sample; None for those that need more values."""
    mean = float(np.mean(values)) if len(values) else None
    return mean, float(np.std(values, ddof=1)) if len(values) > 1 else None


def sample_sentence(found: Json) -> str:
    """A sentence that says which part of the clips was read; empty if all clips were read.

    found: a measurement's JSON.
    """
    if not (sample := found.get("sample")):
        return ""
    return (
        f" Only a part of the clips was read: {sample['excerpts']:,} of {sample['of_excerpts']:,} excerpts "
        f"of at most 20 s, from {sample['clips']:,} of {sample['of']:,} clips, drawn at random."
    )
