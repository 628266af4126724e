"""Checks the targets of a command line before Snakemake plans, and finds the data sets that they need.

A target is the path of a file that a run makes: results/<configuration>/<folder>/<file>,
results/datasets/<data set>/... or results/compare/...
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from hobble.channels import all_channels
from hobble.core.errors import HobbleError, InputError
from hobble.core.section import PhaseMode
from hobble.workflow import lifetime
from hobble.workflow.configurations import COMPARE
from hobble.workflow.project import Project

if TYPE_CHECKING:
    from hobble.config.models import Configuration, SkeletonFile

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
            for sentence in project.clips.notes_on_unused_files(dataset):
                note(f"data set {dataset}: {sentence}")
    return project


def check_targets(project: Project, targets: Iterable[str]) -> list[str]:
    """Validate the targets, and every configuration, data set and skeleton that they need.

    Without targets, the one is checked that Snakemake makes by default. Returns the names of the data sets.
    Raises HobbleError for the first mistake that is found.
    """
    datasets: list[str] = []
    seen: set[str] = set()  # configurations
    for target in list(targets) or ["results/holden/report.html"]:
        _, name, folder, file, *_ = (*Path(target).parts, "", "", "")
        if name == "datasets":
            datasets.append(folder)
        elif name == COMPARE:
            for compared in project.comparison.names():
                datasets += _check_configuration(project, compared, seen)
        elif name and name != PAGE:
            datasets += _check_configuration(project, name, seen)
            _check_target_possible(project, name, folder, file)
    datasets = list(dict.fromkeys(datasets))
    for dataset in datasets:
        _check_dataset(project, dataset)
    for name in seen:
        project.configurations.splits(name)  # raises HobbleError for unusable clips
    return datasets


def _check_configuration(project: Project, name: str, seen: set[str]) -> Iterator[str]:
    """Check a configuration, and those that it names. Yields the names of their data sets.

    seen: the configurations that are checked; this one is added.
    """
    if name in seen:
        return
    seen.add(name)
    configuration = project.catalogue.configuration(name)
    for other in filter(None, (configuration.network_of, configuration.training.continues)):
        if other == name:
            raise HobbleError(
                f"configuration {name} names itself in `network_of` or `training.continues`. "
                "Name another configuration there"
            )
        yield from _check_configuration(project, other, seen)
    if configuration.training.continues:
        _check_continues(project, name, configuration)
    if configuration.training.symmetric and not configuration.network_of:
        _check_symmetric(project, name, configuration)
    yield configuration.dataset


def _check_symmetric(project: Project, name: str, configuration: Configuration) -> None:
    """Check that the network can be symmetric and that the data set has mirrored clips."""
    if configuration.network.why_not_symmetric:
        raise HobbleError(
            f"configuration {name}: training.symmetric: {configuration.network.why_not_symmetric}. "
            "Write `symmetric: false`."
        )
    dataset = configuration.dataset
    if not project.catalogue.dataset(dataset).mirror:
        raise HobbleError(
            f"configuration {name}: training.symmetric: data set {dataset} has no mirrored clips, so its "
            "left and right may differ. Write `mirror: true` in the data set, or `symmetric: false`."
        )


def _check_continues(project: Project, name: str, configuration: Configuration) -> None:
    """Check that a training can continue from the training of another configuration.

    Both must have the same channels, network and number of sections (parts of a pass). The later training
    must not have fewer passes. name, configuration: those of the later training.
    """
    earlier = configuration.training.continues
    if project.configurations.is_built(name):
        kind = configuration.network.kind
        raise HobbleError(
            f"configuration {name} continues from {earlier}, but {kind} is built and not trained. "
            "Remove `training.continues`"
        )
    assert earlier is not None
    start = project.catalogue.configuration(earlier)
    for key, value, start_value in (
        ("channels", list(configuration.channels), list(start.channels)),
        ("network", configuration.network.model_dump(), start.network.model_dump()),
        ("training.sections", configuration.training.sections, start.training.sections),
    ):
        if value != start_value:
            raise HobbleError(
                f"configuration {name} continues from {earlier}, so its {key} must be {start_value}, "
                f"not {value}"
            )
    if configuration.training.passes < start.training.passes:
        raise HobbleError(
            f"configuration {name} continues from {earlier}, which has training.passes: "
            f"{start.training.passes}. Write at least this number, not {configuration.training.passes}"
        )


def _check_dataset(project: Project, name: str) -> None:
    """Check a data set, its clips and its skeleton."""
    dataset = project.catalogue.dataset(name)
    skeleton = project.catalogue.skeleton(dataset.skeleton)
    for clip, entry in project.clips.listed_entries(name).items():
        project.clips.clip_skeleton_files(name, clip)  # raises InputError if the clip has no file
        if entry.recipe is not None:  # what the synthetic walker does
            from hobble.synthetic.plan import RECIPES  # imports numpy, which takes longer than all checks

            if entry.recipe not in RECIPES:
                where, fix = f"data set {name}: clips.{clip}.recipe", f"There are {', '.join(RECIPES)}."
                raise InputError(where, f"no such recipe: {entry.recipe:.80}", fix=fix)
    links = [f"{a}-{b}" for a, b in skeleton.links]
    if dataset.hurt is not None and project.clips.hurt_versions(name):
        if not links:
            raise HobbleError(
                f"data set {name}: hurt: skeleton {dataset.skeleton} has no `links`. Add them to its file."
            )
        if unknown := [link for link in dataset.hurt.links if link not in links]:
            there = ", ".join(links)
            raise HobbleError(
                f"data set {name}: hurt.links: no such link: {', '.join(unknown)}. There are {there}."
            )
    project.datasets.channel_sources.check(name)
    # Raises HobbleError if `held_out` is wrong, or if no clip is left for training.
    project.datasets.splits(name, project.datasets.channel_sources.channels(name))
    if dataset.mirror:
        _check_mirror(dataset.skeleton, skeleton)


def _check_mirror(name: str, skeleton_file: SkeletonFile) -> None:
    """Raise HobbleError for a skeleton that cannot be mirrored. name: the skeleton's name."""
    from hobble.core.skeleton import Skeleton
    from hobble.motion.edit import mirror_skeleton

    skeleton = Skeleton.from_dict({"name": name, **skeleton_file.model_dump(exclude={"maps"})})
    mirror_skeleton(skeleton)
    _ = skeleton.mirror_links  # raises HobbleError if a link has no counterpart on the other side


def _check_target_possible(project: Project, name: str, folder: str, file: str) -> None:
    """Raise HobbleError if the configuration `name` cannot make the target results/<name>/<folder>/<file>."""
    owner = project.catalogue.configuration(name).network_of or name
    if folder == "stimuli" and not project.catalogue.configuration(owner).channels:
        raise HobbleError(
            f"results/{name}/stimuli: configuration {owner} has no `channels`, so it has only one walk to "
            "show. Use a configuration with channels."
        )
    for channel in all_channels():
        if folder in channel.targets and channel.name not in project.catalogue.configuration(owner).channels:
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
