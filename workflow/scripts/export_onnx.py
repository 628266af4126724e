"""Creates an ONNX file of a trained network, checked with onnxruntime."""

from hobble.runtime.network import load_network
from hobble.runtime.onnx_export import write_checked
from hobble.workflow.job import job

with job(snakemake) as log:
    difference = write_checked(
        snakemake.output.onnx, load_network(snakemake.input.weights), snakemake.params.mode
    )
    log.info("onnxruntime gives the runtime's numbers to %.1g", difference)
