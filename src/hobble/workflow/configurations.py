"""Tells the rules about configurations: their sections, clips, measurements, and paths of inputs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from typing import Any

from hobble.config.load_configuration import Catalogue
from hobble.core.errors import HobbleError
from hobble.measures.measure import all_measures, measure_named
from hobble.models.model import BuiltOptions, Options
from hobble.workflow.batches import Batches
from hobble.workflow.clips import DATASETS, Clips, database_folder, original
from hobble.workflow.datasets import Datasets
from hobble.workflow.fingerprint import Package
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


OF_CLIPS = ("clips", "summaries")  # inputs with a file for each clip


def result_file(configuration: str, name: str) -> str:
    """Path of the JSON file with the result of the measurement `name`."""
    return f"results/{configuration}/evaluation/{name}.json"


class Measurements:
    """The measurements of a project's configurations.

    Arguments of the methods: configuration: name of a configuration. name: name of a measurement.
    """

    def __init__(self, configurations: Configurations, clips: Clips, package: Package) -> None:
        self.configurations, self.clips, self.package = configurations, clips, package

    def result_files(self, configuration: str) -> list[str]:
        """Paths of the JSON files of all measurements that are made for the configuration."""
        channels = ("", *self.configurations.channels(configuration))
        return [result_file(configuration, one.name) for one in all_measures() if one.channel in channels]

    def shown_modules(self) -> list[str]:
        """Full names of the modules that show and compare measurements."""
        return [one.module for one in all_measures()]

    def inputs(self, configuration: str, name: str) -> dict[str, str | list[str]]:
        """Name of each input of the measurement -> its file; `batches` -> the folders with rows of clips.

        If an input has the name of another measurement, its file is the result of this other one.
        """
        wanted, dataset = measure_named(name).inputs, self.configurations.dataset(configuration)
        known = {
            "weights": self.configurations.network(configuration, "weights.npz"),
            "skeleton": self.clips.skeleton_file(dataset),
            "published": self.package.published_file(),
        }
        files: dict[str, str | list[str]] = {
            item: known.get(item) or result_file(configuration, measure_named(item).name)
            for item in wanted
            if item not in OF_CLIPS
        }
        if set(OF_CLIPS) & set(wanted):
            files["batches"] = self.configurations.batch_folders(configuration, "database")
        return files

    def params(self, configuration: str, name: str) -> dict[str, Any]:
        """What the script of a measurement gets, as plain data.

        module: full name of the module that holds the measurement. splits: clip -> "train" or "held_out"; {}
        if it does not read clips. summaries: the clips whose summaries of rows it reads. people: clip -> the
        person who walks in it; {} if it does not need this. (If the data set does not name the person in a
        clip, the clip's name stands for one more person. Mirrors and hurt versions have the clip's person.)
        options, runtime: the keys of the sections `evaluation` and `runtime` that it uses.
        """
        chosen, configurations = measure_named(name), self.configurations
        dataset, splits = configurations.dataset(configuration), configurations.splits(configuration)

        def keys(section: str, names: Iterable[str]) -> dict[str, Any]:
            return configurations.section(configuration, section, *names) if names else {}

        return {
            "configuration": configuration,
            "module": chosen.module,
            "splits": splits if "clips" in chosen.inputs else {},
            "summaries": list(splits) if "summaries" in chosen.inputs else [],
            "people": {clip: self.clips.entry(dataset, clip).person or original(clip) for clip in splits}
            if chosen.people
            else {},
            "options": keys("evaluation", chosen.options.model_fields),
            "runtime": keys("runtime", chosen.runtime),
        }

    def code(self, name: str, *modules: str) -> str:
        """Hash of the code of the measurement `name`. modules: what it imports dynamically."""
        return self.package.code("measure", measure_named(name).run_module, *modules)


# Names of the configurations that are compared in results/compare/, unless --config compare=... names others:
# the published networks, and the character that can be hurt.
COMPARED = ("holden", "holden-xl", "holden-xt", "ava", "ava-m", "injured")
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
