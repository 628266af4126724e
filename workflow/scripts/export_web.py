"""Creates results/<configuration>/export/web/: the character as an ES module with an example page."""

from pathlib import Path

from hobble.models.load import load_network
from hobble.report.bundle import export_web
from hobble.runtime import Runtime
from hobble.workflow.job import job

with job(snakemake) as log:
    export_web(
        snakemake.output.folder,
        load_network(snakemake.input.weights),
        Runtime.model_validate(snakemake.params.runtime),
        Path(snakemake.input.bundle).parent / "node_modules",
        snakemake.input.wasm,
    )
    log.info("wrote %s", snakemake.output.folder)
