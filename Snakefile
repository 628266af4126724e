# This workflow turns motion-capture clips into a character that can be hurt. Its usual target is the report of a
# configuration: results/<configuration>/report.html
import sys

import snakemake_logger_plugin_hobble
from hobble.core.errors import HobbleError, keep_traceback
from hobble.workflow import lifetime
from hobble.workflow.estimate import sentences_about_trainings
from hobble.workflow.targets import open_project

lifetime.ensure_user_name()
try:
    project = open_project(workflow, config, sys.argv[1:], logger.warning)
except HobbleError as error:
    raise WorkflowError(str(error)) from None
except Exception as error:
    raise WorkflowError(keep_traceback(error)) from None

# Jobs read this variable, so that they end when this run of Snakemake ends.
lifetime.set_run_variable()


def about_plan(jobs):
    """Sentences about a plan: how long its trainings take. jobs: rule and wildcards of each job."""
    names = [
        wildcards["configuration"] for rule, wildcards in jobs if rule == "training"
    ]
    return sentences_about_trainings(demands, names)


snakemake_logger_plugin_hobble.ABOUT_PLAN.append(about_plan)


onstart:
    if workflow.is_main_process:
        try:
            lifetime.lock()
        except HobbleError as error:
            raise WorkflowError(str(error)) from None
        lifetime.end_jobs_on_signal()
        jobs = [
            (job.rule.name, job.wildcards_dict)
            for job in workflow.dag.needrun_jobs()
        ]
        for sentence in about_plan(jobs):
            logger.warning(sentence)


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
