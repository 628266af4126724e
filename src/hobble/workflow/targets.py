"""Checks the targets of a command line before Snakemake plans, and finds the data sets that they need.

A target is the path of a file that a run makes: results/<configuration>/<folder>/<file>,
results/datasets/<data set>/... or results/compare/...
"""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from hobble.channels import all_channels
from hobble.core.errors import HobbleError, InputError
from hobble.workflow import lifetime
from hobble.workflow.datasets import NamedDataset
from hobble.workflow.project import COMPARE, NamedConfiguration, Project

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
        _, name, folder, *_ = (*Path(target).parts, "", "")
        if name == "datasets":
            datasets.append(folder)
        elif name == COMPARE:
            for compared in project.compared:
                _check_configuration(project, compared.name, configurations)
        elif name and name != PAGE:
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
        _check_network(configuration)


def _check_network(configuration: NamedConfiguration) -> None:
    """Check that the data set has local phases exactly if the network uses them, and what symmetry needs."""
    settings, dataset = configuration.settings, configuration.dataset
    where, uses = f"configuration {configuration.name}", settings.network.uses_local_phases
    if uses != dataset.settings.database.local_phases:
        needs, there = ("needs", "has none") if uses else ("cannot use", "has them")
        raise HobbleError(
            f"{where}: a network of kind {settings.network.kind} {needs} local phases, and data set "
            f"{dataset.name} {there}. Set `database: {{local_phases: {str(uses).lower()}}}` in it."
        )
    if settings.training.symmetric:
        why = settings.network.why_not_symmetric
        if not why and not dataset.settings.mirror:
            why = f"data set {dataset.name} has no mirrored clips, as with `mirror: true`"
        if why:
            raise HobbleError(f"{where}: training.symmetric: {why}. Write `symmetric: false`.")


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
    if settings.mirror:
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
