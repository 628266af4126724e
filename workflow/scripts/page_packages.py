"""Creates results/page/node_modules/: the npm packages in the page's lock file."""

from pathlib import Path

from hobble.report.bundle import install_npm_packages
from hobble.workflow.job import job

with job(snakemake):
    node_modules = Path(snakemake.output[0]).parent
    install_npm_packages(node_modules.parent)
