"""Creates the objects that the Snakefile's rules use, for one checkout and one command line."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hobble.config.load_configuration import Catalogue
from hobble.core.errors import HobbleError
from hobble.workflow.batches import Batches
from hobble.workflow.clips import Clips
from hobble.workflow.configurations import (
    COMPARE,
    COMPARED,
    ComparedConfigurations,
    Configurations,
    Measurements,
)
from hobble.workflow.datasets import Datasets
from hobble.workflow.fingerprint import Package

MOCAP = "mocap"  # key of --config for the folder with the user's clips
RESERVED = (COMPARE, "datasets", "page")  # folders in results/ that do not belong to one configuration


class Project:
    """The configurations and data sets of one checkout, with the overrides of one command line.

    base: the folder of the Snakefile. config: Snakemake's config, which holds the values of `--config`. Its
    key `mocap` is the folder with the user's clips (default: data), and `compare` lists the configurations to
    compare. Every other key overrides the same key of all configurations. Raises HobbleError if a
    configuration has a name in RESERVED, or if `mocap` is not the name of a folder.
    """

    def __init__(self, base: Path, config: Mapping[str, Any]) -> None:
        overrides = {key: value for key, value in config.items() if key not in (MOCAP, COMPARE)}
        self.base = base
        self.catalogue = Catalogue(base / "config", overrides)
        for name in set(RESERVED) & set(self.catalogue.names()):
            raise HobbleError(
                f"no configuration can be called {name}: Hobble uses results/{name} for something else. "
                f"Rename config/{name}.yaml"
            )
        self.clips = Clips(base, _mocap_folder(config.get(MOCAP, base / "data")), self.catalogue)
        self.batches = Batches(self.clips)
        self.datasets = Datasets(self.catalogue, self.clips)
        self.configurations = Configurations(self.catalogue, self.datasets, self.batches)
        self.package = Package(base)
        self.measurements = Measurements(self.configurations, self.clips, self.package)
        self.comparison = ComparedConfigurations(
            self.configurations, self.measurements, config.get(COMPARE, list(COMPARED))
        )


def _mocap_folder(value: Any) -> Path:
    """The folder with the user's clips, from the value that `--config mocap=...` has after parsing as YAML.

    Raises HobbleError if the value is not text, such as a number or a list.
    """
    if isinstance(value, str | Path) and str(value).strip():
        return Path(value)
    raise HobbleError(
        f"--config mocap: must be the name of one folder, as in mocap=/data/mocap, not {value!r:.80}. "
        "Write a folder whose name is a number as mocap=./5"
    )
