"""Checks the targets of a command line before Snakemake plans, and finds the data sets that they need."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from hobble.channels import all_channels
from hobble.config.sections import PhaseMode
from hobble.core.errors import HobbleError, InputError
from hobble.workflow.clip_batches import dataset_of, rules_of_job
from hobble.workflow.comparison import COMPARE
from hobble.workflow.identical_clips import refuse_copies
from hobble.workflow.project import Project

if TYPE_CHECKING:
    from hobble.config.models import ClipEntry, Configuration, Dataset, SkeletonFile

PAGE = "page"  # the folder in results/ with the files that all reports share


def check(project: Project, targets: Iterable[str]) -> None:
    """Validate the targets, and every configuration, data set and skeleton that they need.

    Raises HobbleError for the first mistake.
    """
    for target in targets_or_default(targets):
        _, name, folder, file, *_ = (*Path(target).parts, "", "", "")
        if name == "datasets":
            _check_dataset(project, folder)
        elif name == COMPARE:
            for compared in project.comparison.names():
                _check_configuration(project, compared)
        elif name and name != PAGE:
            _check_configuration(project, name)
            _check_possible(project, name, folder, file)


def notes(project: Project, targets: Iterable[str]) -> list[str]:
    """Notes on unused files in the folders of the data sets that the targets need."""
    names = datasets_of(project, targets)
    return [f"data set {name}: {note}" for name in names for note in project.clips.notes(name)]


def needed_datasets(project: Project, arguments: Sequence[str]) -> list[str]:
    """The data sets that a run of Snakemake needs. arguments: its command line.

    If the run is a job on another machine, it needs only the data set of its rule, if any. If a configuration
    uses or continues the network of another one, the other one's data set is needed, too.
    """
    if rules := rules_of_job(arguments):
        return [name for name in dict.fromkeys(map(dataset_of, rules)) if name]
    return datasets_of(project, [argument for argument in arguments if argument.startswith("results/")])


def datasets_of(project: Project, targets: Iterable[str]) -> list[str]:
    """The data sets that the targets need."""
    names: list[str] = []
    waiting: list[str] = []
    for target in targets_or_default(targets):
        _, name, folder, *_ = (*Path(target).parts, "", "")
        if name == "datasets":
            names.append(folder)
        elif name == COMPARE:
            waiting += project.comparison.names()
        elif name and name != PAGE:
            waiting.append(name)
    seen = set()
    while waiting:
        name = waiting.pop(0)
        if name not in seen:
            seen.add(name)
            model = project.catalogue.configuration(name)
            names.append(model.dataset)
            waiting += filter(None, (model.network_of, model.training.continues))
    return list(dict.fromkeys(names))


def targets_or_default(targets: Iterable[str]) -> list[str]:
    """The targets, or the target that Snakemake makes if none is given."""
    return list(targets) or ["results/holden/report.html"]


def _check_configuration(project: Project, name: str) -> None:
    model = project.catalogue.configuration(name)
    for other in filter(None, (model.network_of, model.training.continues)):
        if other == name:
            raise HobbleError(
                f"configuration {name} names itself in `network_of` or `training.continues`: name another"
            )
        project.catalogue.configuration(other)
    if model.training.continues:
        _check_continues(project, name, model)
    if model.training.symmetric and not model.network_of:
        _check_symmetric(project, name, model)
    _check_dataset(project, model.dataset)
    project.datasets.selected(model.dataset, model.channels)
    refuse_copies(project.clips, project.datasets, model.dataset, tuple(model.channels))


def _check_symmetric(project: Project, name: str, model: Configuration) -> None:
    """Check that the network can be symmetric and that the data set has mirrored clips."""
    if model.network.why_asymmetric:
        raise HobbleError(
            f"configuration {name}: training.symmetric: {model.network.why_asymmetric}. "
            "Write `symmetric: false`."
        )
    if not project.catalogue.dataset(model.dataset).mirror:
        raise HobbleError(
            f"configuration {name}: training.symmetric: data set {model.dataset} has no mirrored clips, so "
            "its left and right may differ. Write `mirror: true` there, or `symmetric: false`."
        )


def _check_continues(project: Project, name: str, model: Configuration) -> None:
    """Check that a training can continue from another one.

    Both must have the same channels, network and sections, and the later one must not have fewer passes.
    """
    earlier = model.training.continues
    if project.configurations.is_built(name):
        kind = model.network.kind
        raise HobbleError(
            f"configuration {name} continues from {earlier}, but {kind} is built and not trained"
        )
    assert earlier is not None
    start = project.catalogue.configuration(earlier)
    for key, value, of_start in (
        ("channels", list(model.channels), list(start.channels)),
        ("network", model.network.model_dump(), start.network.model_dump()),
        ("training.sections", model.training.sections, start.training.sections),
    ):
        if value != of_start:
            raise HobbleError(
                f"configuration {name} continues from {earlier}, so its {key} must be {of_start}, not {value}"
            )
    if model.training.passes < start.training.passes:
        raise HobbleError(
            f"configuration {name} continues from {earlier}, which has {start.training.passes} passes. Its "
            f"training.passes must not be fewer, but it is {model.training.passes}"
        )


def _check_dataset(project: Project, name: str) -> None:
    model = project.catalogue.dataset(name)
    skeleton = project.catalogue.skeleton(model.skeleton)
    for clip, entry in project.clips.listed(name).items():
        project.clips.rig_files(name, clip)  # raises InputError if the clip has no file
        _check_entry(f"data set {name}: clips.{clip}", entry)
    _check_hurt(project, name, model, [f"{a}-{b}" for a, b in skeleton.links])
    project.datasets.channel_sources.check(name)
    project.datasets.selected(name, project.datasets.channel_sources.channels(name))
    if model.mirror:
        _check_mirror(model.skeleton, skeleton)


def _check_entry(where: str, entry: ClipEntry) -> None:
    """Check that the recipe in a clip's entry, for the synthetic walker, exists."""
    if entry.recipe is not None:
        from hobble.synthetic.recipes import RECIPES  # imports numpy, which takes longer than all checks

        if entry.recipe not in RECIPES:
            raise InputError(
                f"{where}.recipe",
                f"no such recipe: {entry.recipe:.80}",
                fix=f"There are {', '.join(RECIPES)}.",
            )


def _check_hurt(project: Project, name: str, model: Dataset, links: Sequence[str]) -> None:
    """Check that the links of a data set's section `hurt` exist."""
    if model.hurt is None or not project.clips.hurt_versions(name):
        return
    if not links:
        raise HobbleError(
            f"data set {name}: hurt: skeleton {model.skeleton} has no `links`. Add them to its file."
        )
    if odd := [link for link in model.hurt.links if link not in links]:
        raise HobbleError(
            f"data set {name}: hurt.links: no such link: {', '.join(odd)}. There are {', '.join(links)}."
        )


def _check_mirror(name: str, skeleton: SkeletonFile) -> None:
    """Raise HobbleError for a skeleton that cannot be mirrored."""
    from hobble.core.skeleton import Skeleton
    from hobble.motion.mirror import mirror_skeleton

    rig = Skeleton.from_dict({"name": name, **skeleton.model_dump(exclude={"maps"})})
    mirror_skeleton(rig)
    _ = rig.mirror_links  # raises HobbleError if a link has no counterpart


def _check_possible(project: Project, name: str, folder: str, file: str) -> None:
    """Raise HobbleError for a target that this configuration cannot have, before anything is trained."""
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
            f"results/{name}/export/{file}: the phase modes are {', '.join(get_args(PhaseMode))}, as in "
            f"results/{name}/export/cubic.onnx"
        )
