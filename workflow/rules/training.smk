rule training:
    """The network, learnt from the database; checkpoints survive a kill."""
    input:
        database=lambda w: configurations.database(w.configuration),
        checkpoint=lambda w: configurations.start(w.configuration),
        clips=lambda w: configurations.rows_in_order(w.configuration),
    output:
        weights="results/{configuration}/network/weights.npz",
        history="results/{configuration}/network/history.csv",
        checkpoint="results/{configuration}/network/checkpoint.npz",
    log:
        "results/{configuration}/logs/training/training.log",
    benchmark:
        "results/{configuration}/benchmarks/training/training.tsv"
    threads: 2
    resources:
        mem_mb=lambda w, attempt: demands.training_memory(w.configuration, attempt),
        runtime=lambda w, attempt: demands.training_minutes(w.configuration, attempt),
        gpu=lambda w: demands.gpus(w.configuration),
    params:
        configuration=lambda w: w.configuration,
        network=lambda w: configurations.section(w.configuration, "network"),
        training=lambda w: configurations.section(w.configuration, "training"),
        terrain_side=lambda w: datasets.options(
            configurations.dataset(w.configuration), "database", "terrain_side"
        )["terrain_side"],
        checkpoints="results/{configuration}/checkpoints",
        code=lambda w: package.code("training", configurations.kind(w.configuration)),
    script:
        "../scripts/training.py"
