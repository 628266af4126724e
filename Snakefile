# This workflow turns motion-capture clips into a character that can be hurt. Its usual target is the report of a
# configuration: results/<configuration>/report.html
import os
import sys
from pathlib import Path

from hobble.core.errors import HobbleError
from hobble.workflow import lifetime
from hobble.workflow.project import Project
from hobble.workflow.targets import check_targets, notes_on_unused_files

lifetime.ensure_user_name()
try:
    # Params of rules contain this path. It is relative, so that no job runs again after the checkout is moved.
    project = Project(Path(os.path.relpath(workflow.basedir)), config)
    if workflow.is_main_process:
        targets = [
            argument for argument in sys.argv[1:] if argument.startswith("results/")
        ]
        check_targets(project, targets)
        for note in notes_on_unused_files(project, targets):
            logger.warning(note)
except HobbleError as error:
    raise WorkflowError(str(error)) from None

# Jobs read this variable, so that they end when this run of Snakemake ends.
lifetime.set_run_variable()


onstart:
    if workflow.is_main_process:
        try:
            lifetime.lock()
        except HobbleError as error:
            raise WorkflowError(str(error)) from None
        lifetime.end_jobs_on_signal()


rule all:
    default_target: True
    input:
        "results/holden/report.html",


include: "workflow/rules/common.smk"
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
