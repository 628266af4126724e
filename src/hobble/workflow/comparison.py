"""Reads which configurations the user wants to compare, and lists the files that the comparison needs."""

from __future__ import annotations

from typing import Any

from hobble.core.errors import HobbleError
from hobble.workflow.configurations import Configurations
from hobble.workflow.measurements import Measurements

COMPARE = "compare"  # name of a folder in results/, and of a key of --config


class ComparedConfigurations:
    """The configurations that `--config compare='[holden,injured]'` names.

    value: what the command line says after `compare=`, not yet checked.
    """

    def __init__(self, configurations: Configurations, measurements: Measurements, value: Any) -> None:
        self.configurations, self.measurements, self._value = configurations, measurements, value

    def names(self) -> list[str]:
        """The names of the configurations. Raises HobbleError if the value is not a list of names."""
        names = self._value.split(",") if isinstance(self._value, str) else self._value
        if not isinstance(names, list) or not all(isinstance(name, str) and name for name in names):
            raise HobbleError(f"compare: must be a list of names, as in '[holden,injured]', not {names!r}")
        if not names or len(set(names)) < len(names):
            raise HobbleError(
                f"compare: must name at least one configuration, each once, not {', '.join(names) or 'none'}"
            )
        return list(names)

    def input_files(self) -> dict[str, list[str]]:
        """Input files of the comparison: kind of file -> paths.

        Each list has one path for each compared configuration, in the order of `names`. Only "measurements"
        has all results of all of them.
        """
        names = self.names()
        return {
            "configuration": [f"results/{name}/configuration.yaml" for name in names],
            "pipeline": [f"results/{name}/pipeline.json" for name in names],
            "history": [self.configurations.network(name, "history.csv") for name in names],
            "measurements": [file for name in names for file in self.measurements.result_files(name)],
        }
