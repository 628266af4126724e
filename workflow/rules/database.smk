from hobble.database import Merging, RowOptions


# Only for data sets with `database: {local_phases: autoencoder}`.
rule phase_autoencoder:
    """The autoencoder that finds local phases in the motion of the training clips."""
    input:
        batches=lambda w: dataset(w).folders(dataset(w).autoencoder_clips, "motion"),
    output:
        weights="results/datasets/{dataset}/autoencoder/weights.npz",
    log:
        "results/datasets/{dataset}/logs/database/phase_autoencoder.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/database/phase_autoencoder.tsv"
    resources:
        mem_mb=4000,
        runtime=60,
    params:
        clips=lambda w: dataset(w).autoencoder_clips,
        code=lambda w: package.code("phase_autoencoder"),
    script:
        "../scripts/phase_autoencoder.py"


rule database_clips:
    """The rows of clips and their mirrors. A row holds the input X, output Y and phase P of one frame."""
    input:
        batches=folders("motion", "labels", "channels", "terrain"),
        # Only if an autoencoder finds the local phases.
        autoencoder=lambda w: dataset(w).autoencoder,
    output:
        batch=directory("results/datasets/{dataset}/batches/database/{batch}"),
    log:
        "results/datasets/{dataset}/logs/database/database_clips/{batch}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/database/database_clips/{batch}.tsv"
    resources:
        mem_mb=memory("database"),
        runtime=minutes("database"),
    params:
        clips=lambda w: [{"clip": name} for name in batch_of(w).names],
        channels=lambda w: dataset(w).channels,
        options=lambda w: plain(
            dataset(w).settings, "database", RowOptions.model_fields
        ),
        code=lambda w: package.code(
            "database_clips",
            *(f"hobble.channels.{name}" for name in dataset(w).channels),
        ),
    script:
        "../scripts/database_clips.py"


rule database_merge:
    """The database: the rows of all clips, shuffled and split into chunks, and statistics of their columns."""
    input:
        batches=rows_and_compared,
    output:
        database=directory("results/datasets/{dataset}/database/{channels}"),
    log:
        "results/datasets/{dataset}/logs/database/database_merge/{channels}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/database/database_merge/{channels}.tsv"
    resources:
        mem_mb=memory("merge"),
        runtime=minutes("merge"),
    params:
        dataset=lambda w: w.dataset,
        splits=splits_of,
        compared=compared_clips,
        channels=lambda w: channels_of_folder(w.channels),
        local_phases=lambda w: has_local_phases(w.channels),
        # Hurt version -> the healthy clip from which it is made.
        sources=lambda w: healthy_originals(splits_of(w)),
        # Hurt version -> n: training uses every n-th of its rows.
        hurt_every=lambda w: {clip: dataset(w).row_step(clip) for clip in healthy_originals(splits_of(w))},
        options=lambda w: plain(dataset(w).settings, "database", Merging.model_fields),
        code=lambda w: package.code(
            "database_merge",
            *(f"hobble.channels.{name}" for name in channels_of_folder(w.channels)),
        ),
    script:
        "../scripts/database_merge.py"
