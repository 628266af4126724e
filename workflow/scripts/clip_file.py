"""Puts a file of a clip at the place where a user asks for it."""

import os
import shutil

from hobble.core.files import atomic_path
from hobble.workflow.job import Inputs, job

with job(snakemake):
    with atomic_path(snakemake.output.file) as temporary:
        shutil.copyfile(Inputs(snakemake.input.batches)(snakemake.params.name), temporary)
    os.utime(snakemake.output.file)
