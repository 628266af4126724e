"""Creates results/page/bundle.js from the page's scripts and the packages that they import."""

from pathlib import Path

from hobble.report.bundle import bundle_page_scripts
from hobble.workflow.job import job

with job(snakemake):
    node_modules = Path(snakemake.input.packages[0]).parent
    bundle_page_scripts(node_modules, snakemake.output.js)
