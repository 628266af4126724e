"""Creates a folder of .bin files, like those of the original release, from a trained network."""

from hobble.models.load import load_network
from hobble.workflow.job import job

with job(snakemake) as log:
    network = load_network(snakemake.input.weights)
    log.info("%s", network.export("bin", snakemake.output.folder, "cubic"))
