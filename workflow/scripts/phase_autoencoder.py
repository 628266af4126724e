"""Creates the autoencoder that finds local phases, from the motion of a data set's training clips."""

import torch

from hobble.core.clip import load_clip
from hobble.labels.autoencoder import save_autoencoder, train
from hobble.workflow.job import Inputs, job

with job(snakemake):
    torch.set_num_threads(1)  # so small a network gains little from more
    torch.use_deterministic_algorithms(True)
    files = Inputs(snakemake.input.batches).each("motion/{clip}.npz", snakemake.params.clips)
    save_autoencoder(snakemake.output.weights, train(map(load_clip, files.values())))
