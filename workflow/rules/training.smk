from hobble.training import Recipe


rule training:
    """The network, trained on the database. If the job is killed, its next run continues from the last checkpoint."""
    input:
        database=lambda w: configuration(w).database,
        # Only if the training continues that of another configuration.
        checkpoint=lambda w: configuration(w).start_checkpoint(),
        # Only for a network that is built from the clips' rows instead of trained.
        batches=lambda w: configuration(w).dataset.folders(
            configuration(w).clips_to_build_from(), "database"
        ),
    output:
        weights="results/{configuration}/network/weights.npz",
        history="results/{configuration}/network/history.csv",
        checkpoint="results/{configuration}/network/checkpoint.npz",
    log:
        "results/{configuration}/logs/training/training.log",
    benchmark:
        "results/{configuration}/benchmarks/training/training.tsv"
    threads: lambda w: demands.training_threads(configuration(w))
    resources:
        mem_mb=memory("training"),
        runtime=minutes("training"),
        gpu=lambda w: demands.gpus(configuration(w)),
        # The training has `processes` processes on each of `nodes` machines. `tasks` (one for each machine) and
        # `gres` (GPUs) are SLURM's names.
        nodes=lambda w: demands.machines_of(configuration(w)).nodes,
        tasks=lambda w: demands.machines_of(configuration(w)).nodes,
        gres=lambda w: demands.gres(configuration(w)),
        processes=lambda w: demands.machines_of(configuration(w)).processes_per_node,
    params:
        configuration=lambda w: w.configuration,
        network=section("network"),
        # Only the keys of the recipe: those about machines do not change the result.
        training=lambda w: plain(
            configuration(w).settings, "training", Recipe.model_fields
        ),
        # Of a network that is built: the clips from whose rows it is built.
        clips=lambda w: configuration(w).clips_to_build_from(),
        terrain_side=lambda w: configuration(w).dataset.settings.database.terrain_side,
        # The folder in which a later run of a killed job finds its checkpoints.
        checkpoints="results/{configuration}/checkpoints",
        code=network_code("training"),
    script:
        "../scripts/training.py"
