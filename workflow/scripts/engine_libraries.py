"""Creates results/page/engine_libraries/: the runtime in C as shared libraries for other systems."""

from hobble.engine import compile_libraries
from hobble.workflow.job import job

with job(snakemake):
    compile_libraries(snakemake.output.folder)
