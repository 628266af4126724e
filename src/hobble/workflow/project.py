"""Creates the objects that the Snakefile's rules use, for one checkout and one command line."""

import functools
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from hobble.config.load_configuration import Catalogue
from hobble.core.errors import HobbleError
from hobble.workflow.configurations import NamedConfiguration
from hobble.workflow.datasets import NamedDataset

MOCAP = "mocap"  # key of --config for the folder with the user's clips
COMPARE = "compare"  # name of a folder in results/, and of a key of --config
# Names of the configurations that are compared in results/compare/, unless --config compare=... names others:
# the published networks, and the character that can be hurt.
COMPARED = ("holden", "holden-xl", "holden-xt", "ava", "ava-m", "injured")
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
        self.mocap = config.get(MOCAP, base / "data")
        if not isinstance(self.mocap, str | Path) or not str(self.mocap).strip():
            raise HobbleError(
                f"--config mocap: must be the name of one folder, as in mocap=/data/mocap, not "
                f"{self.mocap!r:.80}. Write a folder whose name is a number as mocap=./5"
            )
        self._compare = config.get(COMPARE, list(COMPARED))

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def dataset(self, name: str) -> NamedDataset:
        """The data set with this name."""
        return NamedDataset(name, self.base, Path(self.mocap), self.catalogue)

    @functools.cache  # noqa: B019
    def configuration(self, name: str) -> NamedConfiguration:
        """The configuration with this name."""
        dataset = self.dataset(self.catalogue.configuration(name).dataset)
        return NamedConfiguration(name, self.base, self.catalogue, dataset)

    @cached_property
    def compared(self) -> list[NamedConfiguration]:
        """The configurations that `--config compare='[holden,injured]'` names.

        Raises HobbleError if the value is not a list of names.
        """
        names = self._compare.split(",") if isinstance(self._compare, str) else self._compare
        if not isinstance(names, list) or not all(isinstance(name, str) and name for name in names):
            raise HobbleError(f"compare: must be a list of names, as in '[holden,injured]', not {names!r}")
        if not names or len(set(names)) < len(names):
            raise HobbleError(
                f"compare: must name at least one configuration, each once, not {', '.join(names) or 'none'}"
            )
        return list(map(self.configuration, names))

    def walkers(self, names: Iterable[str]) -> list[str]:
        """The data sets whose walkers make the synthetic clips of the data sets `names`.

        A walker computes the motion of synthetic clips. A data set uses the walker of its `source`, or its
        own if it has no `source`.
        """
        used = [each for each in map(self.dataset, names) if each.settings.synthetic is not None]
        return list(dict.fromkeys(each.source_name for each in used))
