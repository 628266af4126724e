"""Creates a configuration's network weights, training history and last checkpoint from its database."""

from pathlib import Path

from hobble.models import network_options
from hobble.training import Machines, Training
from hobble.training.train import run
from hobble.workflow.job import Inputs, job
from hobble.workflow.training_processes import on_machines, train_together

with job(snakemake):
    options = Training.model_validate(snakemake.params.training)
    machines = Machines(nodes=snakemake.resources.tasks, processes=snakemake.resources.processes)
    has_gpus = bool(snakemake.resources.get("gpu") or snakemake.resources.get("gres"))
    training = on_machines(options, machines, has_gpus)
    start = Path(snakemake.input.checkpoint[0]) if snakemake.input.checkpoint else None
    arguments = {
        "database": Path(snakemake.input.database),
        "network": network_options(snakemake.params.network),
        "training": training,
        "checkpoints": Path(snakemake.params.checkpoints),
        "start": start,
        "code": snakemake.params.get("code"),
    }
    if machines.count > 1:
        train_together(machines, snakemake.threads, Path(snakemake.log[0]), arguments)
    # If several processes have trained, `run` starts at their last checkpoint and has nothing left to train.
    # Otherwise it trains. Then it writes the outputs.
    run(
        **arguments,
        configuration=snakemake.params.configuration,
        threads=snakemake.threads,
        weights=Path(snakemake.output.weights),
        history=Path(snakemake.output.history),
        checkpoint=Path(snakemake.output.checkpoint),
        terrain_side=snakemake.params.terrain_side,
        clips=Inputs(snakemake.input.batches).each("database/clips/{clip}.npz", snakemake.params.clips),
    )
