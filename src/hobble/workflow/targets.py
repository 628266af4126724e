"""Checks the targets of a command line before Snakemake plans, and finds the data sets that they need.

A target is the path of a file that a run makes: results/<configuration>/<folder>/<file>,
results/datasets/<data set>/... or results/compare/...
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from hobble.channels import all_channels
from hobble.core.errors import HobbleError, InputError
from hobble.core.section import PhaseMode
from hobble.workflow import lifetime
from hobble.workflow.configurations import NamedConfiguration
from hobble.workflow.datasets import NamedDataset
from hobble.workflow.project import COMPARE, Project

if TYPE_CHECKING:
    from hobble.config.models import SkeletonFile

PAGE = "page"  # the folder in results/ with the files that all reports share


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
        _, name, folder, file, *_ = (*Path(target).parts, "", "", "")
        if name == "datasets":
            datasets.append(folder)
        elif name == COMPARE:
            for compared in project.compared:
                _check_configuration(project, compared.name, configurations)
        elif name and name != PAGE:
            _check_configuration(project, name, configurations)
            _check_target_possible(configurations[name], project, folder, file)
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
        if other == name:
            raise HobbleError(
                f"configuration {name} names itself in `network_of` or `training.continues`. "
                "Name another configuration there"
            )
        _check_configuration(project, other, seen)
    if settings.training.continues:
        _check_continues(configuration, seen[settings.training.continues])
    if not settings.network_of:
        _check_local_phases(configuration)
    if settings.training.symmetric and not settings.network_of:
        _check_symmetric(configuration)


def _check_symmetric(configuration: NamedConfiguration) -> None:
    """Check that the network can be symmetric and that the data set has mirrored clips."""
    where = f"configuration {configuration.name}: training.symmetric"
    if why := configuration.settings.network.why_not_symmetric:
        raise HobbleError(f"{where}: {why}. Write `symmetric: false`.")
    if not configuration.dataset.settings.mirror:
        raise HobbleError(
            f"{where}: data set {configuration.dataset.name} has no mirrored clips, so its left and right "
            "may differ. Write `mirror: true` in the data set, or `symmetric: false`."
        )


def _check_local_phases(configuration: NamedConfiguration) -> None:
    """Check that the data set has local phases exactly if the network uses them."""
    network, dataset = configuration.settings.network, configuration.dataset
    if network.uses_local_phases != dataset.settings.database.local_phases:
        there = "has none" if network.uses_local_phases else "has them"
        raise HobbleError(
            f"configuration {configuration.name}: a network of kind {network.kind} "
            f"{'needs' if network.uses_local_phases else 'cannot use'} local phases, and data set "
            f"{dataset.name} {there}. Set `database: {{local_phases: "
            f"{str(network.uses_local_phases).lower()}}}` in a data set that extends it."
        )


def _check_continues(later: NamedConfiguration, earlier: NamedConfiguration) -> None:
    """Check that a training can continue from that of another configuration.

    Both must have the same channels, network and number of sections (parts of a pass). The later training
    must not have fewer passes.
    """
    where = f"configuration {later.name} continues from {earlier.name}"
    new, old = later.settings, earlier.settings
    if later.is_built:
        raise HobbleError(
            f"{where}, but {new.network.kind} is built and not trained. Remove `training.continues`"
        )
    for key, value, wanted in (
        ("channels", list(new.channels), list(old.channels)),
        ("network", new.network.model_dump(), old.network.model_dump()),
        ("training.sections", new.training.sections, old.training.sections),
    ):
        if value != wanted:
            raise HobbleError(f"{where}, so its {key} must be {wanted}, not {value}")
    if new.training.passes < old.training.passes:
        raise HobbleError(
            f"{where}, which has training.passes: {old.training.passes}. Write at least this number, not "
            f"{new.training.passes}"
        )


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
        if not links:
            raise HobbleError(
                f"{where}: hurt: skeleton {settings.skeleton} has no `links`. Add them to its file."
            )
        if unknown := [link for link in settings.hurt.links if link not in links]:
            there = ", ".join(links)
            raise HobbleError(f"{where}: hurt.links: no such link: {', '.join(unknown)}. There are {there}.")
    dataset.check_channels()
    dataset.splits(dataset.channels)  # raises HobbleError if `held_out` is wrong, or leaves no clip
    if settings.mirror:
        _check_mirror(settings.skeleton, skeleton)


def _check_mirror(name: str, skeleton_file: SkeletonFile) -> None:
    """Raise HobbleError for a skeleton that cannot be mirrored. name: the skeleton's name."""
    from hobble.core.skeleton import Skeleton
    from hobble.motion.edit import mirror_skeleton

    skeleton = Skeleton.from_dict({"name": name, **skeleton_file.model_dump(exclude={"maps"})})
    mirror_skeleton(skeleton)
    _ = skeleton.mirror_links  # raises HobbleError if a link has no counterpart on the other side


def _check_target_possible(
    configuration: NamedConfiguration, project: Project, folder: str, file: str
) -> None:
    """Raise HobbleError if a configuration cannot make the target results/<name>/<folder>/<file>."""
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
    stem, _, suffix = file.rpartition(".")
    if folder == "export" and suffix == "onnx" and stem not in get_args(PhaseMode):
        raise HobbleError(
            f"results/{name}/export/{file}: {stem} is not a phase mode. The phase modes are "
            f"{', '.join(get_args(PhaseMode))}, as in results/{name}/export/cubic.onnx"
        )
