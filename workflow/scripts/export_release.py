"""Creates a folder of .bin files, like those that Holden et al. (2017) released, from a trained network."""

from hobble.models.load import load_network
from hobble.workflow.job import job

with job(snakemake) as log:
    network = load_network(snakemake.input.weights)
    log.info("%s", network.export("bin", snakemake.output.folder, "cubic"))
