"""Creates an ONNX file of a trained network, checked with onnxruntime."""

from hobble.models.load import load_network
from hobble.workflow.job import job

with job(snakemake) as log:
    network = load_network(snakemake.input.weights)
    log.info("%s", network.export("onnx", snakemake.output.onnx, snakemake.params.mode))
