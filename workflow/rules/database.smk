from hobble.database.options import Merging, RowOptions

for batch in [*batches_of_clips, *batches_of_versions]:

    rule:
        """The rows of clips: inputs X, outputs Y and phase P of a network."""
        name:
            batch.rule("database_clips")
        input:
            clip=batch.of_names("motion/{clip}.npz"),
            labels=batch.of_names("labels/{clip}.npz"),
            # All channels of the first clip, then all of the second, ...
            channels=[
                f"results/datasets/{batch.dataset}/channels/{channel}/{name}.npz"
                for name in batch.names
                for channel in datasets.channel_sources.channels(batch.dataset)
            ],
            terrain=batch.of_names("terrain/clips/{clip}.npz"),
        output:
            rows=batch.of_names("database/clips/{clip}.npz"),
            summaries=batch.of_names("database/clips/{clip}.json"),
        log:
            batch.log("database", "database_clips"),
        benchmark:
            batch.benchmark("database", "database_clips")
        threads: 1
        resources:
            mem_mb=lambda w, attempt, batch=batch: demands.batch_memory(
                batch, 22, attempt
            ),
            runtime=lambda w, attempt, batch=batch: demands.batch_minutes(
                batch, 0.15 * (1 + batch.mirrored), attempt
            ),
        params:
            per_clip=lambda w, batch=batch: [{"clip": name} for name in batch.names],
            files_per_clip=lambda w, batch=batch: {
                "channels": [len(datasets.channel_sources.channels(batch.dataset))]
                * len(batch.names)
            },
            channels=lambda w, batch=batch: datasets.channel_sources.channels(
                batch.dataset
            ),
            options=lambda w, batch=batch: datasets.part(
                batch.dataset, "database", RowOptions
            ),
            code=lambda w, batch=batch: package.code(
                "database_clips",
                *channel_packages(datasets.channel_sources.channels(batch.dataset)),
            ),
        script:
            "../scripts/database_clips.py"


def clips_of(dataset, channels, file, shard=None):
    """The path `file` for each clip of a database, or of one of its shards."""
    names = (
        datasets.selected(dataset, channels_of_folder(channels))
        if shard is None
        else datasets.in_shard(dataset, channels_of_folder(channels), int(shard))
    )
    return expand(f"results/datasets/{dataset}/{file}", clip=names)


def compared(w, file):
    """The path `file` for each clip that is compared with others, so that no motion is both trained on and held out.

    If the rule makes a shard, only clips of this shard are in the list.
    """
    names = datasets.compared(w.dataset, channels_of_folder(w.channels))
    if hasattr(w, "shard"):
        own = datasets.in_shard(w.dataset, channels_of_folder(w.channels), int(w.shard))
        names = [name for name in names if name in own]
    return expand(f"results/datasets/{w.dataset}/{file}", clip=names)


def shards_of(w):
    """The folders of a database's shards; none if one job reads all clips."""
    count = datasets.shards(w.dataset)
    return [
        f"results/datasets/{w.dataset}/database/shards/{w.channels}/{number}"
        for number in range(count if count > 1 else 0)
    ]


rule database_shard:
    """The rows of some clips of a database, shuffled and in chunks."""
    input:
        clips=lambda w: clips_of(
            w.dataset, w.channels, "database/clips/{clip}.npz", w.shard
        ),
        compared=lambda w: compared(w, "motion/{clip}.npz"),
        reports=lambda w: compared(w, "motion/{clip}.json"),
    output:
        shard=directory("results/datasets/{dataset}/database/shards/{channels}/{shard}"),
    log:
        "results/datasets/{dataset}/logs/database/database_shard/{channels}-{shard}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/database/database_shard/{channels}-{shard}.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.shard_memory(w.dataset, attempt),
        runtime=lambda w, attempt: demands.shard_minutes(w.dataset, 0.1, attempt),
    params:
        splits=lambda w: datasets.in_shard(
            w.dataset, channels_of_folder(w.channels), int(w.shard)
        ),
        channels=lambda w: channels_of_folder(w.channels),
        sources=lambda w: datasets.sources(
            datasets.in_shard(w.dataset, channels_of_folder(w.channels), int(w.shard))
        ),
        every=lambda w: datasets.hurt_row_step(w.dataset),
        options=lambda w: datasets.part(w.dataset, "database", Merging),
        code=lambda w: package.code(
            "database_shard", *channel_packages(channels_of_folder(w.channels))
        ),
    script:
        "../scripts/database_shard.py"


rule database_merge:
    """The rows of all clips, shuffled and in chunks, with their statistics."""
    input:
        clips=lambda w: (
            []
            if shards_of(w)
            else clips_of(w.dataset, w.channels, "database/clips/{clip}.npz")
        ),
        # To check that no motion is both trained on and held out.
        compared=lambda w: [] if shards_of(w) else compared(w, "motion/{clip}.npz"),
        reports=lambda w: [] if shards_of(w) else compared(w, "motion/{clip}.json"),
        shards=shards_of,
    output:
        database=directory("results/datasets/{dataset}/database/{channels}"),
    log:
        "results/datasets/{dataset}/logs/database/database_merge/{channels}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/database/database_merge/{channels}.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.shard_memory(w.dataset, attempt),
        runtime=lambda w, attempt: demands.shard_minutes(w.dataset, 0.1, attempt),
    params:
        dataset=lambda w: w.dataset,
        splits=lambda w: datasets.selected(w.dataset, channels_of_folder(w.channels)),
        channels=lambda w: channels_of_folder(w.channels),
        sources=lambda w: datasets.sources(
            datasets.selected(w.dataset, channels_of_folder(w.channels))
        ),
        every=lambda w: datasets.hurt_row_step(w.dataset),
        options=lambda w: datasets.part(w.dataset, "database", Merging),
        code=lambda w: package.code(
            "database_merge", *channel_packages(channels_of_folder(w.channels))
        ),
    script:
        "../scripts/database_merge.py"
