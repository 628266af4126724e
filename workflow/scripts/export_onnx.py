"""Creates an ONNX file of a trained network in one phase mode, and checks it with onnxruntime.

The phase mode says how weights are computed from the phase: constant, linear or cubic.
"""

from hobble.models.load import load_network
from hobble.workflow.job import job

with job(snakemake) as log:
    network = load_network(snakemake.input.weights)
    log.info("%s", network.export("onnx", snakemake.output.onnx, snakemake.params.mode))
