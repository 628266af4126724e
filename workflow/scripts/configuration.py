"""Creates results/<configuration>/configuration.yaml: all keys of the configuration and of its data set.

Keys with inherited or default values are in the file, too.
"""

from pathlib import Path

import yaml

from hobble.core.files import write_text
from hobble.workflow.job import job
from hobble.workflow.project import Project

with job(snakemake):
    project = Project(Path(snakemake.params.base), snakemake.config)
    resolved = project.configuration(snakemake.params.name).resolved()
    write_text(snakemake.output.yaml, yaml.safe_dump(resolved, sort_keys=False))
