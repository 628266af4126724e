"""Creates results/page/node_modules/ from the page's lock file and the npm registry."""

from pathlib import Path

from hobble.report.bundle import install
from hobble.workflow.job import job

with job(snakemake):
    install(Path(snakemake.output[0]).parents[1])
