"""Tells Snakemake's rules about configurations: their sections, their clips, and paths of their inputs."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from hobble.config.load_configuration import Catalogue
from hobble.models import model_of_kind
from hobble.models.model import BuiltModel, Model
from hobble.workflow.channel_sources import database_folder
from hobble.workflow.clips import DATASETS
from hobble.workflow.datasets import Datasets


class Configurations:
    """The configurations of a project. Each method has the name of a configuration as first argument."""

    def __init__(self, catalogue: Catalogue, datasets: Datasets) -> None:
        self.catalogue, self.datasets = catalogue, datasets

    def section(self, configuration: str, name: str, *keys: str) -> dict[str, Any]:
        """Key -> value of one section of a configuration as plain data, for `keys` or for all keys."""
        values = getattr(self.catalogue.configuration(configuration), name).model_dump(mode="json")
        return {key: values[key] for key in keys} if keys else values

    def resolved(self, configuration: str) -> dict[str, Any]:
        """All keys of a configuration and of its data set, as plain data.

        Of another configuration that it uses (`network_of`, `training.continues`) only the name is included.
        """
        settings = self.catalogue.configuration(configuration)
        dataset = self.catalogue.dataset(settings.dataset).model_dump(mode="json")
        return {
            "name": configuration,
            "configuration": settings.model_dump(mode="json"),
            "dataset": {"name": settings.dataset, **dataset},
        }

    def digest(self, configuration: str) -> str:
        """A hash of `resolved`, short enough to be printed as a rule's param in a dry run."""
        text = json.dumps(self.resolved(configuration), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def dataset(self, configuration: str) -> str:
        """The name of the data set that the configuration learns from."""
        return self.catalogue.configuration(configuration).dataset

    def channels(self, configuration: str) -> tuple[str, ...]:
        """The channels that are inputs of the configuration's network."""
        return self.catalogue.configuration(configuration).channels

    def splits(self, configuration: str) -> dict[str, str]:
        """Clip -> "train" or "held_out", for the clips that suit the network.

        A clip is left out if it has values other than 0 in a channel that the network lacks.
        """
        return self.datasets.splits(self.dataset(configuration), self.channels(configuration))

    def dataset_files(self, configuration: str, pattern: str) -> list[str]:
        """Paths of files in the data set's folder.

        pattern: a path in this folder. If it contains {clip}, there is a path for each clip of `splits`, else
        there is one path.
        """
        root = f"{DATASETS}/{self.dataset(configuration)}"
        if "{clip}" not in pattern:
            return [f"{root}/{pattern}"]
        return [f"{root}/{pattern.format(clip=clip)}" for clip in self.splits(configuration)]

    def network_owner(self, configuration: str) -> str:
        """Name of the configuration that trains the network: `network_of`, or this one if it is not set."""
        return self.catalogue.configuration(configuration).network_of or configuration

    def model_package(self, configuration: str) -> str:
        """Full name of the Python package for the kind of network, such as hobble.models.pfnn."""
        return f"hobble.models.{self.catalogue.configuration(self.network_owner(configuration)).network.kind}"

    def model(self, configuration: str) -> Model:
        """The object MODEL of the package `model_package`, which describes the kind of network."""
        return model_of_kind(self.catalogue.configuration(self.network_owner(configuration)).network.kind)

    def network(self, configuration: str, file: str) -> str:
        """Path of `file` in the folder of the configuration's network."""
        return f"results/{self.network_owner(configuration)}/network/{file}"

    def database(self, configuration: str) -> str:
        """Path of the folder with the rows for training, which is named after the network's channels."""
        folder = database_folder(self.channels(configuration))
        return f"{DATASETS}/{self.dataset(configuration)}/database/{folder}"

    def is_built(self, configuration: str) -> bool:
        """Whether the network is built directly from the rows of the clips instead of trained."""
        return isinstance(self.model(configuration), BuiltModel)

    def training_row_files(self, configuration: str) -> list[str]:
        """If the network is built: a file for each training clip, in the order of `splits`. Else [].

        A file holds the rows of its clip, in order of frames.
        """
        if not self.is_built(configuration):
            return []
        root = f"{DATASETS}/{self.dataset(configuration)}/database/clips"
        return [
            f"{root}/{clip}.npz" for clip, split in self.splits(configuration).items() if split == "train"
        ]

    def start_checkpoint(self, configuration: str) -> list[str]:
        """Path of the checkpoint from which the training continues, in a list; [] if there is none."""
        other = self.catalogue.configuration(configuration).training.continues
        return [f"results/{other}/network/checkpoint.npz"] if other else []
