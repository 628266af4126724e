"""Creates results/<configuration>/configuration.yaml from the resolved configuration in the rule's params."""

import yaml

from hobble.core.files import write_text
from hobble.workflow.job import job

with job(snakemake):
    write_text(snakemake.output.yaml, yaml.safe_dump(snakemake.params.resolved, sort_keys=False))
