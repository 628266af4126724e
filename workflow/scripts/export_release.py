"""Creates the original release's folder of .bin files from a trained network."""

from hobble.runtime.network import load_network
from hobble.runtime.release import write_release
from hobble.workflow.job import job

with job(snakemake) as log:
    write_release(snakemake.output.folder, load_network(snakemake.input.weights))
    log.info("wrote %s", snakemake.output.folder)
