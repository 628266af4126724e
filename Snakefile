# This workflow turns motion-capture clips into a character that can be hurt. Its usual target is the report of a
# configuration: results/<configuration>/report.html
import gc
import os
import sys
from pathlib import Path

from hobble.channels import channel_packages, display_modules
from hobble.core.errors import HobbleError
from hobble.workflow import lifetime, lock_files, named_outputs
from hobble.workflow.user_account import check_may_write, ensure_user_name
from hobble.workflow.costs import stages
from hobble.workflow.resource_demands import Demands
from hobble.workflow.measurements import NAMES as MEASURES
from hobble.workflow.project import Project
from hobble.workflow.targets import (
    check_targets,
    needed_datasets,
    notes_on_unused_files,
)
from hobble.workflow.channel_sources import channels_of_folder

# While Snakemake plans, it makes millions of small objects and frees few of them. If the garbage collector runs less
# often, planning takes an eighth less time (measured with 2,500 clips).
gc.set_threshold(200_000, 50, 1000)
# The next two lines replace functions of Snakemake. It then plans faster, and does not fail if another run that ends
# removes the folder of locks.
named_outputs.use_named_outputs()
lock_files.tolerate_removed_folder()
ensure_user_name()
try:
    if workflow.is_main_process:
        check_may_write(sys.argv[1:])
    # Params of rules contain this path. It is relative, so that no job runs again after the checkout is moved.
    project = Project(Path(os.path.relpath(workflow.basedir)), config)
    targets = [argument for argument in sys.argv[1:] if argument.startswith("results/")]
    check_targets(project, targets)
    if workflow.is_main_process:
        for note in notes_on_unused_files(project, targets):
            logger.warning(note)
    # A batch is a set of clips that one job processes. Each batch has its own rules. Data sets that no target needs
    # get no rules, because these would make planning slower.
    datasets_needed = needed_datasets(project, sys.argv[1:])
    batches_of_clips = project.batches.needed(
        project.batches.of_listed_clips, datasets_needed, sys.argv[1:]
    )
    batches_of_hurt_versions = project.batches.needed(
        project.batches.of_hurt_versions, datasets_needed, sys.argv[1:]
    )
    batches_of_synthetic_clips = project.batches.needed(
        project.batches.of_listed_clips,
        project.datasets.walkers(datasets_needed),
        sys.argv[1:],
    )
except HobbleError as error:
    raise WorkflowError(str(error)) from None

# Jobs read this variable, so that they end when this run of Snakemake ends.
lifetime.set_run_variable()
lifetime.clear_stale_lock()

# The objects that the rules use, see hobble.workflow.project. In functions of rules, `w` holds the job's wildcards.
catalogue = project.catalogue
clips = project.clips
datasets = project.datasets
configurations = project.configurations
comparison = project.comparison
package = project.package
measurements = project.measurements
demands = Demands(project)


onstart:
    if workflow.is_main_process:
        lifetime.record_lock_owner()
        lifetime.end_jobs_on_signal()


wildcard_constraints:
    configuration="|".join(catalogue.names()),
    dataset=r"[^/]+",
    clip=r"[^/]+(?<!_mirror)",
    channels=r"plain|[a-z_+]+(?<!clips)",
    measure="|".join(MEASURES),
    piece="[a-z]+",
    shard=r"\d+",


def keep_local(files):
    """Mark the files that are not results as local: they stay on disk if results are in an object store.

    files: a path, a list of paths, or a dictionary with such values. The return value has the same form.
    """
    if isinstance(files, dict):
        return {name: keep_local(value) for name, value in files.items()}
    paths = [files] if isinstance(files, str) else files
    marked = [path if path.startswith("results/") else local(path) for path in paths]
    return marked[0] if isinstance(files, str) else marked


def files_of_batch(batch, files_of_clip):
    """The files of all clips of a batch. files_of_clip: function (dataset, clip) -> list of the clip's files."""
    return keep_local(
        [file for clip in batch.clips for file in files_of_clip(batch.dataset, clip)]
    )


def file_counts(batch, files_of_clip):
    """The number of files of each clip of a batch. files_of_clip: as in `files_of_batch`."""
    return [len(files_of_clip(batch.dataset, clip)) for clip in batch.clips]


rule all:
    default_target: True
    input:
        "results/holden/report.html",


include: "workflow/rules/synthetic.smk"
include: "workflow/rules/motion.smk"
include: "workflow/rules/labels.smk"
include: "workflow/rules/channels.smk"
include: "workflow/rules/hurt.smk"
include: "workflow/rules/terrain.smk"
include: "workflow/rules/database.smk"
include: "workflow/rules/training.smk"
include: "workflow/rules/runtime.smk"
include: "workflow/rules/evaluation.smk"
include: "workflow/rules/report.smk"
