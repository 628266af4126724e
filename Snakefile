# From motion capture to a character that can be hurt. The usual target is results/<configuration>/report.html
import sys
from functools import partial

import snakemake_logger_plugin_hobble
from hobble.core.errors import HobbleError, keep_traceback
from hobble.workflow import lifetime
from hobble.workflow.demands import sentences_about_plan
from hobble.workflow.project import open_project

lifetime.ensure_user_name()
try:
    project = open_project(workflow, config, sys.argv[1:], logger.warning)
except HobbleError as error:
    raise WorkflowError(str(error)) from None
except Exception as error:
    raise WorkflowError(keep_traceback(error)) from None

# Jobs read this variable, so that they end when this run of Snakemake ends.
lifetime.set_run_variable()
about_plan = partial(sentences_about_plan, project)
snakemake_logger_plugin_hobble.ABOUT_PLAN.append(about_plan)


# With `--sdm apptainer` each job runs in this image, which `docker build -t hobble .` makes.
container: "docker-daemon://hobble:latest"


onstart:
    if workflow.is_main_process:
        try:
            lifetime.lock()
        except HobbleError as error:
            raise WorkflowError(str(error)) from None
        lifetime.end_jobs_on_signal()
        needed = workflow.dag.needrun_jobs()
        jobs = [(job.rule.name, job.wildcards_dict) for job in needed]
        for sentence in about_plan(jobs):
            logger.warning(sentence)


# What `make report` makes.
rule all:
    default_target: True
    input:
        "results/limp/report.html",


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
