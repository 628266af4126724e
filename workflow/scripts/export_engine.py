"""Creates results/<configuration>/export/engine/: the character for game engines."""

from hobble.engine.export import export_engine
from hobble.models.load import load_network
from hobble.runtime import Runtime
from hobble.workflow.job import job

with job(snakemake) as log:
    network = load_network(snakemake.input.weights)
    runtime = Runtime.model_validate(snakemake.params.runtime)
    export_engine(snakemake.output.folder, network, runtime, snakemake.input.wasm)
    log.info("wrote %s", snakemake.output.folder)
