# From motion capture to a character that can be hurt. Targets: results/<configuration>/report.html
import gc
import os
import sys
from pathlib import Path

from hobble.channels import modules_of, shown_modules
from hobble.core.errors import HobbleError
from hobble.measures.registry import names_of_modules
from hobble.workflow import lifetime, lock_files, named_outputs
from hobble.workflow.user_account import check_may_write, ensure_user_name
from hobble.workflow.costs import stages
from hobble.workflow.resource_demands import Demands
from hobble.workflow.measurements import NAMES as MEASURES
from hobble.workflow.project import Project
from hobble.workflow.targets import check, needed_datasets, notes
from hobble.workflow.channel_sources import channels_of_folder

# Planning makes millions of small objects that stay. If the garbage collector runs less often, planning 2,500 clips
# takes an eighth less time.
gc.set_threshold(200_000, 50, 1000)
named_outputs.use()
lock_files.use()
ensure_user_name()
try:
    if workflow.is_main_process:
        check_may_write(sys.argv[1:])
    # The path is relative, so that nothing runs again after the checkout is moved.
    project = Project(Path(os.path.relpath(workflow.basedir)), config)
    targets = [argument for argument in sys.argv[1:] if argument.startswith("results/")]
    check(project, targets)
    if workflow.is_main_process:
        for note in notes(project, targets):
            logger.warning(note)
    # Each batch has rules of its own. Rules for data sets that no target needs would only cost time.
    needed = needed_datasets(project, sys.argv[1:])
    batches_of_clips = project.batches.needed(project.batches.of, needed, sys.argv[1:])
    batches_of_versions = project.batches.needed(
        project.batches.hurt_of, needed, sys.argv[1:]
    )
    batches_of_walker = project.batches.needed(
        project.batches.of, project.datasets.walkers(needed), sys.argv[1:]
    )
except HobbleError as error:
    raise WorkflowError(str(error)) from None

lifetime.set_run_variable()
lifetime.clear_stale_lock()

# The objects that the rules use, see hobble.workflow.project.
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
    """Mark files of the checkout or the user as local, because results may be in an object store."""
    if isinstance(files, dict):
        return {name: keep_local(some) for name, some in files.items()}
    many = [files] if isinstance(files, str) else files
    many = [f if f.startswith("results/") else local(f) for f in many]
    return many[0] if isinstance(files, str) else many


def for_each(batch, files):
    """The files of all clips of a batch. files: function (dataset, clip) -> list of the clip's files."""
    return keep_local(
        [file for clip in batch.clips for file in files(batch.dataset, clip)]
    )


def counted(batch, files):
    """The number of files of each clip of a batch. files: as in `for_each`."""
    return [len(files(batch.dataset, clip)) for clip in batch.clips]


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
