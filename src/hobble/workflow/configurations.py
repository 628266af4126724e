"""Tells Snakemake's rules about configurations: their sections, their clips, and paths of their inputs."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from hobble.config.load_configuration import Catalogue
from hobble.models.model import BuiltOptions, Options
from hobble.workflow.batches import Batches
from hobble.workflow.channel_sources import database_folder
from hobble.workflow.clips import DATASETS
from hobble.workflow.datasets import Datasets
from hobble.workflow.job import RECORDS

# Stage of a data set -> its rules that have a job for each batch of clips.
BATCH_RULES = {
    "synthetic": (),
    "motion": ("motion_clips", "hurt_clips"),
    "labels": ("labels_clips",),
    "channels": ("channel_clips",),
    "terrain": ("terrain_fits",),
    "database": ("database_clips",),
}


class Configurations:
    """The configurations of a project. Each method has the name of a configuration as first argument."""

    def __init__(self, catalogue: Catalogue, datasets: Datasets, batches: Batches) -> None:
        self.catalogue, self.datasets, self.batches = catalogue, datasets, batches

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

    def batch_folders(self, configuration: str, *stages: str) -> list[str]:
        """The folders with the files that some stages have made of the clips of `splits`."""
        return self.batches.folders(self.dataset(configuration), self.splits(configuration), *stages)

    def network_owner(self, configuration: str) -> str:
        """Name of the configuration that trains the network: `network_of`, or this one if it is not set."""
        return self.catalogue.configuration(configuration).network_of or configuration

    def model_package(self, configuration: str) -> str:
        """Full name of the Python package for the kind of network, such as hobble.models.pfnn."""
        return f"hobble.models.{self.network_options(configuration).kind}"

    def network_options(self, configuration: str) -> Options:
        """The options of the configuration's network."""
        return self.catalogue.configuration(self.network_owner(configuration)).network

    def network(self, configuration: str, file: str) -> str:
        """Path of `file` in the folder of the configuration's network."""
        return f"results/{self.network_owner(configuration)}/network/{file}"

    def database(self, configuration: str) -> str:
        """Path of the folder with the rows for training, which is named after the network's channels."""
        folder = database_folder(self.channels(configuration))
        return f"{DATASETS}/{self.dataset(configuration)}/database/{folder}"

    def is_built(self, configuration: str) -> bool:
        """Whether the network is built directly from the rows of the clips instead of trained."""
        return isinstance(self.network_options(configuration), BuiltOptions)

    def clips_to_build_from(self, configuration: str) -> list[str]:
        """If the network is built: the training clips, in the order of `splits`. Else []."""
        splits = self.splits(configuration) if self.is_built(configuration) else {}
        return [clip for clip, split in splits.items() if split == "train"]

    def start_checkpoint(self, configuration: str) -> list[str]:
        """Path of the checkpoint from which the training continues, in a list; [] if there is none."""
        other = self.catalogue.configuration(configuration).training.continues
        return [f"results/{other}/network/checkpoint.npz"] if other else []

    def stages(self, configuration: str) -> dict[str, dict[str, list[str]]]:
        """Where to find what each stage has cost, see `hobble.report.provenance.summarise_pipeline`."""
        name = self.dataset(configuration)
        source = self.catalogue.dataset(name).source or name
        results, root = f"results/{configuration}", f"{DATASETS}/{name}"
        out = {}
        for stage, rules in BATCH_RULES.items():
            home = f"{DATASETS}/{source}" if stage == "synthetic" else root
            out[stage] = {
                "benchmarks": [f"{home}/benchmarks/{stage}"],
                "files": [f"{home}/{stage}"],
                "batches": list(self.batches.of_dataset(name)),
                "made": [f"{home}/{RECORDS}/{rule}" for rule in rules],
            }
        out["database"]["files"] = [f"{root}/database/clips", self.database(configuration)]
        trained = f"results/{self.network_owner(configuration)}"
        out["training"] = {"benchmarks": [f"{trained}/benchmarks/training"], "files": [f"{trained}/network"]}
        for stage in ("runtime", "evaluation"):
            out[stage] = {"benchmarks": [f"{results}/benchmarks/{stage}"], "files": [f"{results}/{stage}"]}
        return out
