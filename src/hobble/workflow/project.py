"""Tells the rules about configurations: their sections, clips, measurements, and paths of inputs."""

import functools
import hashlib
import json
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from hobble.config.load_configuration import Catalogue
from hobble.core.clip_files import original
from hobble.core.errors import HobbleError
from hobble.measures.measure import all_measures, measure_named
from hobble.models.model import BuiltOptions, Options
from hobble.workflow.datasets import DATASETS, NamedDataset, database_folder, plain
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
PUBLISHED = "src/hobble/report/published.yaml"  # errors and times of others, with which ours are compared
OF_CLIPS = ("clips", "summaries")  # inputs of measurements with a file for each clip
MOCAP = "mocap"  # key of --config for the folder with the user's clips
COMPARE = "compare"  # name of a folder in results/, and of a key of --config
# Names of the configurations that are compared in results/compare/, unless --config compare=... names others:
# the published networks, and the character that can be hurt.
COMPARED = ("holden", "holden-xl", "holden-xt", "ava", "ava-m", "injured")
RESERVED = (COMPARE, "datasets", "page")  # folders in results/ that do not belong to one configuration


class NamedConfiguration:
    """What the rules ask about one configuration.

    dataset: the data set that it learns from.
    """

    def __init__(self, name: str, base: Path, catalogue: Catalogue, dataset: NamedDataset) -> None:
        self.name, self.base, self.dataset = name, base, dataset
        self.settings = catalogue.configuration(name)
        self.channels = self.settings.channels
        self.network_owner = self.settings.network_of or name  # the configuration that trains the network
        self.network_options: Options = catalogue.configuration(self.network_owner).network
        # The package for the kind of network, such as hobble.models.pfnn.
        self.model_package = f"hobble.models.{self.network_options.kind}"
        # Whether the network is built directly from the rows of the clips instead of trained.
        self.is_built = isinstance(self.network_options, BuiltOptions)

    def resolved(self) -> dict[str, Any]:
        """All keys of the configuration and of its data set, as plain data.

        Of another configuration that it uses (`network_of`, `training.continues`) only the name is included.
        """
        return {
            "name": self.name,
            "configuration": self.settings.model_dump(mode="json"),
            "dataset": {"name": self.dataset.name, **self.dataset.settings.model_dump(mode="json")},
        }

    def digest(self) -> str:
        """A hash of `resolved`, short enough to be printed as a rule's param in a dry run."""
        return hashlib.sha256(json.dumps(self.resolved(), sort_keys=True).encode()).hexdigest()[:16]

    @cached_property
    def splits(self) -> dict[str, str]:
        """Clip -> "train" or "held_out", for the clips that suit the network.

        A clip is left out if it has values other than 0 in a channel that the network lacks.
        """
        return self.dataset.splits(self.channels)

    def folders(self, *stages: str) -> list[str]:
        """The folders with the files that some stages have made of the clips of `splits`."""
        return self.dataset.folders(self.splits, *stages)

    def network(self, file: str) -> str:
        """Path of `file` in the folder of the network."""
        return f"results/{self.network_owner}/network/{file}"

    @property
    def database(self) -> str:
        """Path of the folder with the rows for training, which is named after the network's channels."""
        return f"{self.dataset.root}/database/{database_folder(self.channels)}"

    def clips_to_build_from(self) -> list[str]:
        """If the network is built: the training clips, in the order of `splits`. Else []."""
        return [clip for clip, split in self.splits.items() if split == "train"] if self.is_built else []

    def start_checkpoint(self) -> list[str]:
        """Path of the checkpoint from which the training continues, in a list; [] if there is none."""
        other = self.settings.training.continues
        return [f"results/{other}/network/checkpoint.npz"] if other else []

    def stages(self) -> dict[str, dict[str, list[str]]]:
        """Where to find what each stage has cost, see `hobble.report.provenance.summarise_pipeline`."""
        results, root = f"results/{self.name}", self.dataset.root
        out = {}
        for stage, rules in BATCH_RULES.items():
            home = f"{DATASETS}/{self.dataset.source_name}" if stage == "synthetic" else root
            out[stage] = {
                "benchmarks": [f"{home}/benchmarks/{stage}"],
                "files": [f"{home}/{stage}"],
                "batches": list(self.dataset.batches),
                "made": [f"{home}/{RECORDS}/{rule}" for rule in rules],
            }
        out["database"]["files"] = [f"{root}/database/clips", self.database]
        trained = f"results/{self.network_owner}"
        out["training"] = {"benchmarks": [f"{trained}/benchmarks/training"], "files": [f"{trained}/network"]}
        for stage in ("runtime", "evaluation"):
            out[stage] = {"benchmarks": [f"{results}/benchmarks/{stage}"], "files": [f"{results}/{stage}"]}
        return out

    def result_file(self, measure: str) -> str:
        """Path of the JSON file with the result of a measurement."""
        return f"results/{self.name}/evaluation/{measure}.json"

    def result_files(self) -> list[str]:
        """Paths of the JSON files of all measurements that are made."""
        return [self.result_file(one.name) for one in all_measures() if one.channel in ("", *self.channels)]

    def measure_inputs(self, name: str) -> dict[str, str | list[str]]:
        """Name of each input of a measurement -> its file; `batches` -> the folders with rows of clips.

        If an input has the name of another measurement, its file is the result of this other one.
        """
        wanted = measure_named(name).inputs
        known = {
            "weights": self.network("weights.npz"),
            "skeleton": self.dataset.skeleton_file,
            "published": str(self.base / PUBLISHED),
        }
        files: dict[str, str | list[str]] = {
            item: known.get(item) or self.result_file(measure_named(item).name)
            for item in wanted
            if item not in OF_CLIPS
        }
        if set(OF_CLIPS) & set(wanted):
            files["batches"] = self.folders("database")
        return files

    def measure_params(self, name: str) -> dict[str, Any]:
        """What the script of a measurement gets, as plain data.

        module: full name of the module that holds the measurement. splits: clip -> "train" or "held_out"; {}
        if it does not read clips. summaries: the clips whose summaries of rows it reads. people: clip -> the
        person who walks in it; {} if it does not need this. (If the data set does not name the person in a
        clip, the clip's name stands for one more person. Mirrors and hurt versions have the clip's person.)
        options, runtime: the keys of the sections `evaluation` and `runtime` that it uses.
        """
        chosen = measure_named(name)
        people = {clip: self.dataset.entry(clip).person or original(clip) for clip in self.splits}
        return {
            "configuration": self.name,
            "module": chosen.module,
            "splits": self.splits if "clips" in chosen.inputs else {},
            "summaries": list(self.splits) if "summaries" in chosen.inputs else [],
            "people": people if chosen.people else {},
            "options": plain(self.settings, "evaluation", chosen.options.model_fields),
            "runtime": plain(self.settings, "runtime", chosen.runtime),
        }


class Project:
    """The configurations and data sets of one checkout, with the overrides of one command line.

    base: the folder of the Snakefile. config: Snakemake's config, which holds the values of `--config`. Its
    key `mocap` is the folder with the user's clips (default: data), and `compare` lists the configurations to
    compare. Every other key overrides the same key of all configurations. Raises HobbleError if a
    configuration has a name in RESERVED.
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
        self.mocap = Path(str(config.get(MOCAP, base / "data")))
        self._compare = config.get(COMPARE, list(COMPARED))

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def dataset(self, name: str) -> NamedDataset:
        """The data set with this name."""
        return NamedDataset(name, self.base, self.mocap, self.catalogue)

    @functools.cache  # noqa: B019
    def configuration(self, name: str) -> NamedConfiguration:
        """The configuration with this name."""
        dataset = self.dataset(self.catalogue.configuration(name).dataset)
        return NamedConfiguration(name, self.base, self.catalogue, dataset)

    @cached_property
    def compared(self) -> list[NamedConfiguration]:
        """The configurations that `--config compare='[holden,injured]'` names.

        Raises HobbleError if the value is not a list of names, each once.
        """
        names = self._compare.split(",") if isinstance(self._compare, str) else self._compare
        is_list = isinstance(names, list) and names and all(isinstance(name, str) and name for name in names)
        if not is_list or len(set(names)) < len(names):
            raise HobbleError(
                f"compare: must be a list of names, each once, as in '[holden,injured]', not {names!r}"
            )
        return list(map(self.configuration, names))
