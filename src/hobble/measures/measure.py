"""The description of a measurement, which Snakemake reads at planning.

A measurement is a package. Its `__init__` holds `MEASURE`, a `Measure`, and must not import anything slow.
The other modules of the package are found by name:

- `run.py`: `run(given, options) -> Outcome`, the measuring itself (see `given`);
- `page.py`: what the report shows of it (see `hobble.report.measured`), if anything;
- `comparison.py`: what it says of configurations side by side
  (see `hobble.evaluation.compare_configurations`), if anything;
- `comparison_page.py`: what the comparison's page shows of that (see `hobble.report.measured`), if anything.
"""

from __future__ import annotations

import importlib
import importlib.util
from dataclasses import dataclass
from types import ModuleType

from hobble.core.section import Section

# Inputs of a measurement. Any other name is that of another measurement, whose JSON is the input.
INPUTS = ("weights", "clips", "facts", "skeleton", "published")


@dataclass(frozen=True)
class Cost:
    """Memory (MB) and time that a job requests on a cluster.

    memory_mb: fixed part. memory_each: for each thousand frames of 31 joints in the longest clip.
    seconds_each: the same over all clips. minutes: at least.
    """

    memory_mb: float = 0.0
    memory_each: float = 0.0
    seconds_each: float = 0.0
    minutes: int = 10


@dataclass(frozen=True)
class Measure:
    """A measurement: its `name` is that of its JSON, and of its folder of tables.

    package: where its parts lie (`__name__` of the package). inputs: of INPUTS, or names of other
    measurements. options: its keys of the section `evaluation`. runtime: the keys of the section `runtime`
    that it depends on. people: whether it has to know who walks in which clip.
    """

    name: str
    package: str
    inputs: tuple[str, ...]
    options: type[Section] = Section
    runtime: tuple[str, ...] = ()
    people: bool = False
    cost: Cost = Cost()

    def has(self, part: str) -> bool:
        """Whether it has the module `part`."""
        return importlib.util.find_spec(self.module(part)) is not None

    def module(self, part: str) -> str:
        """Full name of its module `part`."""
        return f"{self.package}.{part}"

    def part(self, part: str) -> ModuleType | None:
        """Its module `part`, imported; None where it has none."""
        return importlib.import_module(self.module(part)) if self.has(part) else None
