"""What rules ask of a configuration: its sections, its clips, and where what it is made from lies."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from hobble.config.load import Catalogue
from hobble.workflow.channel_sources import database_folder
from hobble.workflow.clips import DATASETS
from hobble.workflow.datasets import Datasets


class Configurations:
    """The configurations of a project."""

    def __init__(self, catalogue: Catalogue, datasets: Datasets) -> None:
        self.catalogue, self.datasets = catalogue, datasets

    def section(self, configuration: str, name: str, *keys: str) -> dict[str, Any]:
        """Plain values of one section of a configuration: of those `keys`, or of all where none is named."""
        values = getattr(self.catalogue.configuration(configuration), name).model_dump(mode="json")
        return {key: values[key] for key in keys} if keys else values

    def resolved(self, configuration: str) -> dict[str, Any]:
        """Everything that determines a configuration's results, as plain data."""
        model = self.catalogue.configuration(configuration)
        dataset = self.catalogue.dataset(model.dataset).model_dump(mode="json")
        return {
            "name": configuration,
            "configuration": model.model_dump(mode="json"),
            "dataset": {"name": model.dataset, **dataset},
        }

    def digest(self, configuration: str) -> str:
        """A short name for all that `resolved` says, so that a dry run does not print it."""
        text = json.dumps(self.resolved(configuration), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def dataset(self, configuration: str) -> str:
        """The name of the data set that it learns from."""
        return self.catalogue.configuration(configuration).dataset

    def channels(self, configuration: str) -> tuple[str, ...]:
        """The channels that its network is told."""
        return self.catalogue.configuration(configuration).channels

    def splits(self, configuration: str) -> dict[str, str]:
        """Clip -> split."""
        return self.datasets.selected(self.dataset(configuration), self.channels(configuration))

    def of_dataset(self, configuration: str, pattern: str) -> list[str]:
        """`pattern` (with {clip} in it, or not) under the configuration's data set, for each of its clips."""
        root = f"{DATASETS}/{self.dataset(configuration)}"
        if "{clip}" not in pattern:
            return [f"{root}/{pattern}"]
        return [f"{root}/{pattern.format(clip=clip)}" for clip in self.splits(configuration)]

    def owner(self, configuration: str) -> str:
        """The configuration whose network it reads: itself, or another."""
        return self.catalogue.configuration(configuration).network_of or configuration

    def kind(self, configuration: str) -> str:
        """The package of the kind of network that it trains or reads: hobble.models.pfnn."""
        return f"hobble.models.{self.catalogue.configuration(self.owner(configuration)).network.kind}"

    def network(self, configuration: str, file: str) -> str:
        """A file of the configuration's network, or of the network it reads."""
        return f"results/{self.owner(configuration)}/network/{file}"

    def database(self, configuration: str) -> str:
        """The database that the configuration learns from."""
        folder = database_folder(self.channels(configuration))
        return f"{DATASETS}/{self.dataset(configuration)}/database/{folder}"

    def start(self, configuration: str) -> list[str]:
        """The checkpoint that training goes on from, if it continues another configuration's."""
        other = self.catalogue.configuration(configuration).training.continues
        return [f"results/{other}/network/checkpoint.npz"] if other else []
