"""Puts a file of a clip at the place where a user asks for it."""

import os
import shutil

from hobble.core.files import atomic_path, load_npz, read_json
from hobble.workflow.job import Inputs, job

with job(snakemake):
    file = Inputs(snakemake.input.batches)(snakemake.params.name)
    load_npz(file) if file.endswith(".npz") else read_json(file)  # a damaged file is not copied
    with atomic_path(snakemake.output.file) as temporary:
        shutil.copyfile(file, temporary)
    os.utime(snakemake.output.file)
