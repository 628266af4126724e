"""How a measurement is described to the workflow, which reads the description at planning.

A measurement is a package. Its `__init__` holds `MEASURE`, a `Measure`, and must not import anything slow.
The other modules of the package are found by name:

- `run.py`: its function `run(inputs, options)` measures and returns an `Outcome` (see
  `hobble.measures.inputs`). A long measurement may be split into pieces, which run as jobs of their own:
  `run_piece(inputs, options, piece) -> Json` measures one piece, and `run` puts them together;
- `page.py`: what the report shows of the measurement (see `hobble.report.measure_sections`), if anything;
- `comparison.py`: what it adds to the comparison of several configurations
  (see `hobble.evaluation.compare_configurations`), if anything;
- `comparison_page.py`: what the page of this comparison shows of it
  (see `hobble.report.measure_sections`), if anything.
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

# Inputs of a measurement: the network, the rows of the clips, summaries of these rows, the skeleton,
# published results. Any other name is that of another measurement, whose JSON is the input.
INPUTS = ("weights", "clips", "summaries", "skeleton", "published")


@dataclass(frozen=True)
class Cost:
    """Memory and time that a job requests on a cluster.

    memory_mb: MB that it needs however little data there is. memory_each: MB added for each thousand frames
    of the longest clip. seconds_each: seconds for each thousand frames of all clips together. memory_each and
    seconds_each are for 31 joints and grow in proportion to the number of joints. minutes: the least time.
    """

    memory_mb: float = 0.0
    memory_each: float = 0.0
    seconds_each: float = 0.0
    minutes: int = 10


class Pieces(Protocol):
    """A function that returns the names of a measurement's pieces. A name consists of letters only."""

    def __call__(self, options: Any, runtime: Runtime, modes: Sequence[str]) -> tuple[str, ...]:
        """options: of the type `Measure.options`. modes: names of the ways to evaluate
        the network that is measured, such as constant, linear and cubic (`Network.modes`).
        """


@dataclass(frozen=True)
class Measure:
    """A measurement. Its `name` is also the name of its JSON file and of its folder of tables.

    package: full name of its package (`__name__`). inputs: names of INPUTS or of other
    measurements. options: the class of its keys in a configuration's section `evaluation`. runtime: the keys
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

    def has(self, part: str) -> bool:
        """Whether its package has a module named `part`, such as `page`."""
        return importlib.util.find_spec(self.module(part)) is not None

    def module(self, part: str) -> str:
        """Full name of the module `part` of its package."""
        return f"{self.package}.{part}"

    def part(self, part: str) -> ModuleType | None:
        """The module `part` of its package, imported; None if there is none."""
        return importlib.import_module(self.module(part)) if self.has(part) else None
