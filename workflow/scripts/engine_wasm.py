"""Creates results/page/engine.wasm: the runtime in C, compiled to WebAssembly."""

from hobble.engine import compile_wasm
from hobble.workflow.job import job

with job(snakemake):
    compile_wasm(snakemake.output.wasm)
