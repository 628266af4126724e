"""The description of a measurement, which the workflow reads when it plans its jobs.

A measurement is a package. Its `__init__` holds `MEASURE`, a `Measure`. It must not import anything slow,
because planning imports it. The other modules of the package are found by name:

- `run.py`: its function `run(inputs, options)` measures and returns an `Outcome` (see
  `hobble.measures.inputs`). A long measurement may be split into pieces, which run as jobs of their own:
  `run_piece(inputs, options, piece) -> Json` measures one piece, and `run` puts their results together;
- `page.py`, if the report shows the measurement: how it shows it (see `hobble.report.templates`);
- `comparison.py`, if the measurement is part of the comparison of several configurations: what it adds to
  compare.json (see `hobble.evaluation.compare_configurations`);
- `comparison_page.py`, if the page of this comparison shows the measurement: how it shows it (see
  `hobble.report.templates`).
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Protocol

from hobble.core.section import Section
from hobble.runtime.options import Runtime

# Names of inputs: the network, the rows of the clips, summaries of these rows, the skeleton, and published
# results. A measurement may also read the JSON of another measurement. This input has the name of the other.
INPUTS = ("weights", "clips", "summaries", "skeleton", "published")


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


class Pieces(Protocol):
    """The type of a function that returns the names of a measurement's pieces (letters only).

    A piece is a part of a long measurement that runs as a job of its own.
    """

    def __call__(self, options: Any, runtime: Runtime, modes: Sequence[str]) -> tuple[str, ...]:
        """The names of the pieces.

        options: of the type `Measure.options`. modes: names of the ways to evaluate the measured network,
        such as constant, linear and cubic (`Network.modes`).
        """


@dataclass(frozen=True)
class Measure:
    """A measurement. Its JSON file and its folder of tables have its `name`, too.

    package: full name of its package (`__name__`). inputs: what it reads, as names of INPUTS or of other
    measurements. options: the model of its keys in a configuration's section `evaluation`. runtime: the keys
    of the section `runtime` that it depends on. pieces: for a measurement that is split, the function that
    returns the names of its pieces. people: whether it has to know who walks in which clip. cost: what its
    job requests on a cluster.
    """

    name: str
    package: str
    inputs: tuple[str, ...]
    options: type[Section] = Section
    runtime: tuple[str, ...] = ()
    pieces: Pieces | None = None
    people: bool = False
    cost: Cost = Cost()

    def has_module(self, part: str) -> bool:
        """Whether its package has a module named `part`, such as `page`."""
        return importlib.util.find_spec(self.module_name(part)) is not None

    def module_name(self, part: str) -> str:
        """Full name of the module `part` of its package."""
        return f"{self.package}.{part}"

    def import_module(self, part: str) -> ModuleType | None:
        """The module `part` of its package, imported; None if there is none."""
        return importlib.import_module(self.module_name(part)) if self.has_module(part) else None
