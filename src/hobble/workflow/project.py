"""Tells the rules about configurations: their sections, clips, measurements, and paths of inputs.

Also checks the targets of a command line before Snakemake plans. A target is the path of a file that a run
makes: results/<configuration>/<folder>/<file>, results/datasets/<data set>/... or results/compare/...
"""

import functools
import hashlib
import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from hobble.channels import all_channels
from hobble.config.load_configuration import Catalogue
from hobble.core.clip_files import original
from hobble.core.errors import HobbleError, InputError
from hobble.measures.measure import all_measures, measure_named
from hobble.models.model import BuiltOptions, Options
from hobble.workflow import lifetime
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
        """Path of the folder with the rows for training, which is named after what the network reads."""
        folder = database_folder(self.channels, self.settings.network.uses_local_phases)
        return f"{self.dataset.root}/database/{folder}"

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


# Checks of the targets of a command line, and of all that they need.


def open_project(workflow: Any, config: Mapping[str, Any], words: Sequence[str], note: Callable) -> Project:
    """The project of the Snakefile that Snakemake reads now.

    workflow, config: Snakemake's own. words: the command line; the targets among them are checked. note:
    prints a sentence. If another workflow imports this one as a module, nothing is checked, because the
    targets are its own. Raises HobbleError for a mistake in the targets or in what they need, and for
    `--configfile`.
    """
    base = Path(workflow.current_basedir.get_path_or_uri(secret_free=True))
    if not workflow.modifier.is_main_snakefile():
        return Project(base, config)
    # Params of rules contain this path. It is relative, so that no job runs again after a checkout is moved.
    project = Project(Path(os.path.relpath(base)), config)
    if workflow.is_main_process:
        lifetime.check_writable()
        if files := workflow.overwrite_configfiles:
            raise HobbleError(
                f"--configfile {Path(files[0]).name} would put its values into every configuration, so that "
                "results/holden/ held another network. For a configuration of this name in config/, type "
                f"results/{Path(files[0]).stem}/report.html. For single keys, use --config."
            )
        for dataset in check_targets(project, [word for word in words if word.startswith("results/")]):
            for sentence in project.dataset(dataset).notes_on_unused_files():
                note(f"data set {dataset}: {sentence}")
    return project


def check_targets(project: Project, targets: Iterable[str]) -> list[str]:
    """Validate the targets, and every configuration, data set and skeleton that they need.

    Without targets, the one is checked that Snakemake makes by default. Returns the names of the data sets.
    Raises HobbleError for the first mistake that is found.
    """
    datasets: list[str] = []
    configurations: dict[str, NamedConfiguration] = {}
    for target in list(targets) or ["results/limp/report.html"]:
        _, name, folder, *_ = (*Path(target).parts, "", "")
        if name == "datasets":
            datasets.append(folder)
        elif name == COMPARE:
            for compared in project.compared:
                _check_configuration(project, compared.name, configurations)
        elif name and name not in RESERVED:
            _check_configuration(project, name, configurations)
            _check_target_possible(configurations[name], project, folder)
    used = [configuration.dataset.name for configuration in configurations.values()]
    datasets = list(dict.fromkeys([*datasets, *used]))
    for dataset in datasets:
        _check_dataset(project, project.dataset(dataset))
    for configuration in configurations.values():
        _ = configuration.splits  # raises HobbleError for unusable clips
    return datasets


def _check_configuration(project: Project, name: str, seen: dict[str, NamedConfiguration]) -> None:
    """Check a configuration, and those that it names. seen: those that are checked; this one is added."""
    if name in seen:
        return
    configuration = seen[name] = project.configuration(name)
    settings = configuration.settings
    for other in filter(None, (settings.network_of, settings.training.continues)):
        _check_configuration(project, other, seen)
    if settings.training.continues:
        _check_continues(configuration, seen[settings.training.continues])
    if not settings.network_of:
        _check_symmetric(configuration)


def _check_symmetric(configuration: NamedConfiguration) -> None:
    """Check that the network can have what `training.symmetric` needs."""
    settings, dataset = configuration.settings, configuration.dataset
    if settings.training.symmetric:
        why = settings.network.why_not_symmetric
        if not why and not dataset.settings.mirror:
            why = f"data set {dataset.name} has no mirrored clips, as with `mirror: true`"
        if why:
            where = f"configuration {configuration.name}: training.symmetric"
            raise HobbleError(f"{where}: {why}. Write `symmetric: false`.")


def _check_continues(later: NamedConfiguration, earlier: NamedConfiguration) -> None:
    """Check that a training can continue from that of another configuration.

    Both must have the same channels, network and number of sections (parts of a pass). The later training
    must not have fewer passes.
    """
    where = f"configuration {later.name} continues from {earlier.name}"
    new, old = later.settings, earlier.settings
    for key, value, wanted in (
        ("channels", list(new.channels), list(old.channels)),
        ("network", new.network.model_dump(), old.network.model_dump()),
        ("training.sections", new.training.sections, old.training.sections),
    ):
        if value != wanted:
            raise HobbleError(f"{where}, so its {key} must be {wanted}, not {value}")
    if new.training.passes < old.training.passes:
        passes = f"{old.training.passes:g} or more, not {new.training.passes:g}"
        raise HobbleError(f"{where}, so its training.passes must be {passes}")


def _check_dataset(project: Project, dataset: NamedDataset) -> None:
    """Check a data set, its clips and its skeleton."""
    settings, where = dataset.settings, f"data set {dataset.name}"
    skeleton = project.catalogue.skeleton(settings.skeleton)
    for clip, entry in dataset.listed.items():
        dataset.clip_skeleton_files(clip)  # raises InputError if the clip has no file
        if entry.recipe is not None:  # what the synthetic walker does
            from hobble.synthetic.plan import RECIPES  # imports numpy, which takes longer than all checks

            if entry.recipe not in RECIPES:
                place, fix = f"{where}: clips.{clip}.recipe", f"There are {', '.join(RECIPES)}."
                raise InputError(place, f"no such recipe: {entry.recipe:.80}", fix=fix)
    links = [f"{a}-{b}" for a, b in skeleton.links]
    if settings.hurt is not None and dataset.hurt_versions:
        unknown = [link for link in settings.hurt.links if link not in links]
        if unknown or not links:
            problem = f"no such link: {', '.join(unknown)}" if unknown else "the skeleton has no `links`"
            raise HobbleError(f"{where}: hurt.links: {problem}. There are {', '.join(links) or 'none'}.")
    dataset.check_channels()
    dataset.splits(dataset.channels)  # raises HobbleError if `held_out` is wrong, or leaves no clip
    if settings.mirror or settings.database.local_phases == "autoencoder":
        from hobble.core.skeleton import Skeleton  # imports numpy, too
        from hobble.motion.edit import mirror_skeleton

        rig = Skeleton.from_dict({"name": settings.skeleton, **skeleton.model_dump(exclude={"maps"})})
        mirror_skeleton(rig)
        _ = rig.mirror_links  # raises HobbleError if a link has no counterpart on the other side


def _check_target_possible(configuration: NamedConfiguration, project: Project, folder: str) -> None:
    """Raise HobbleError if a configuration cannot make the files in results/<name>/<folder>/."""
    name, owner = configuration.name, configuration.network_owner
    channels = project.catalogue.configuration(owner).channels
    if folder == "stimuli" and not channels:
        raise HobbleError(
            f"results/{name}/stimuli: configuration {owner} has no `channels`, so it has only one walk to "
            "show. Use a configuration with channels."
        )
    for channel in all_channels():
        if folder in channel.targets and channel.name not in channels:
            raise HobbleError(
                f"results/{name}/{folder}: the network of configuration {owner} has no channel "
                f"{channel.name}. Use a configuration with `channels: [{channel.name}]`."
            )
