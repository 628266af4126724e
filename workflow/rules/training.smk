from hobble.training.options import Recipe


rule training:
    """The network, trained on the database. If the job is killed, its next run continues from the last checkpoint."""
    input:
        database=lambda w: configurations.database(w.configuration),
        # Only if the training continues that of another configuration.
        checkpoint=lambda w: configurations.start_checkpoint(w.configuration),
        # Only for a network that is built from the clips' rows instead of trained.
        batches=lambda w: batches.folders(
            configurations.dataset(w.configuration),
            configurations.clips_to_build_from(w.configuration),
            "database",
        ),
    output:
        weights="results/{configuration}/network/weights.npz",
        history="results/{configuration}/network/history.csv",
        checkpoint="results/{configuration}/network/checkpoint.npz",
    log:
        "results/{configuration}/logs/training/training.log",
    benchmark:
        "results/{configuration}/benchmarks/training/training.tsv"
    threads: lambda w: demands.training_threads(w.configuration)
    resources:
        mem_mb=memory("training"),
        runtime=minutes("training"),
        gpu=lambda w: demands.gpus(w.configuration),
        # The training has `processes` processes on each of `nodes` machines. `tasks` (one for each machine) and
        # `gres` (GPUs) are SLURM's names.
        nodes=lambda w: demands.machines(w.configuration).nodes,
        tasks=lambda w: demands.machines(w.configuration).nodes,
        gres=lambda w: demands.gres(w.configuration),
        processes=lambda w: demands.machines(w.configuration).processes_per_node,
    params:
        configuration=lambda w: w.configuration,
        network=lambda w: configurations.section(w.configuration, "network"),
        # Only the keys of the recipe: those about machines do not change the result.
        training=lambda w: configurations.section(
            w.configuration, "training", *Recipe.model_fields
        ),
        # Of a network that is built: the clips from whose rows it is built.
        clips=lambda w: configurations.clips_to_build_from(w.configuration),
        terrain_side=lambda w: datasets.options(
            configurations.dataset(w.configuration), "database", "terrain_side"
        )["terrain_side"],
        # The folder in which a later run of a killed job finds its checkpoints.
        checkpoints="results/{configuration}/checkpoints",
        code=lambda w: package.code(
            "training", configurations.model_package(w.configuration)
        ),
    script:
        "../scripts/training.py"
