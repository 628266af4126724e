# Objects such as `clips`, `datasets` and `demands` are made in the Snakefile.

from hobble.database.options import Merging, RowOptions

# A batch is a set of clips that one job processes. Each batch has its own rule.
for batch in [*batches_of_clips, *batches_of_hurt_versions]:

    rule:
        """The rows of clips and their mirrors. A row holds the input X, output Y and phase P of one frame."""
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
            # The numbers below are MB and seconds for each thousand frames.
            mem_mb=lambda w, attempt, batch=batch: demands.batch_memory(
                batch, 22, attempt
            ),
            runtime=lambda w, attempt, batch=batch: demands.batch_minutes(
                batch, 0.15 * (1 + batch.mirrored), attempt
            ),
        params:
            # One dictionary for each clip, which is a piece of the job: see hobble.workflow.batch_job.
            per_clip=lambda w, batch=batch: [{"clip": name} for name in batch.names],
            # Name of an input -> the number of its files for each clip.
            files_per_clip=lambda w, batch=batch: {
                "channels": [len(datasets.channel_sources.channels(batch.dataset))]
                * len(batch.names)
            },
            channels=lambda w, batch=batch: datasets.channel_sources.channels(
                batch.dataset
            ),
            options=lambda w, batch=batch: datasets.options_of_class(
                batch.dataset, "database", RowOptions
            ),
            code=lambda w, batch=batch: package.code(
                "database_clips",
                *channel_packages(datasets.channel_sources.channels(batch.dataset)),
            ),
        script:
            "../scripts/database_clips.py"


def clips_of(dataset, channels, file, shard=None):
    """The path `file`, which contains {clip}, for each clip of a database, or of one of its shards.

    A shard is the part of a database that one job makes from some of the clips. shard: its number, from 0.
    """
    names = (
        datasets.splits(dataset, channels_of_folder(channels))
        if shard is None
        else datasets.splits_in_shard(dataset, channels_of_folder(channels), int(shard))
    )
    return expand(f"results/datasets/{dataset}/{file}", clip=names)


def compared_files(w, file):
    """The path `file`, which contains {clip}, for each clip that is compared with the others.

    The comparison finds copies, so that no motion is both trained on and held out. If the rule makes a shard, only
    clips of this shard are in the list.
    """
    names = datasets.clips_to_compare(w.dataset, channels_of_folder(w.channels))
    if hasattr(w, "shard"):
        in_shard = datasets.splits_in_shard(
            w.dataset, channels_of_folder(w.channels), int(w.shard)
        )
        names = [name for name in names if name in in_shard]
    return expand(f"results/datasets/{w.dataset}/{file}", clip=names)


def shards_of(w):
    """The folders of a database's shards; [] if the database is not split, so that one job reads all clips."""
    count = datasets.shards(w.dataset)
    return [
        f"results/datasets/{w.dataset}/database/shards/{w.channels}/{number}"
        for number in range(count if count > 1 else 0)
    ]


rule database_shard:
    """A shard of a database: the rows of some of its clips, shuffled and split into chunks."""
    input:
        clips=lambda w: clips_of(
            w.dataset, w.channels, "database/clips/{clip}.npz", w.shard
        ),
        compared=lambda w: compared_files(w, "motion/{clip}.npz"),
        reports=lambda w: compared_files(w, "motion/{clip}.json"),
    output:
        shard=directory("results/datasets/{dataset}/database/shards/{channels}/{shard}"),
    log:
        "results/datasets/{dataset}/logs/database/database_shard/{channels}-{shard}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/database/database_shard/{channels}-{shard}.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.shard_memory(w.dataset, attempt),
        # .1 s for each thousand frames.
        runtime=lambda w, attempt: demands.shard_minutes(w.dataset, 0.1, attempt),
    params:
        # Clip -> "train" or "held_out".
        splits=lambda w: datasets.splits_in_shard(
            w.dataset, channels_of_folder(w.channels), int(w.shard)
        ),
        channels=lambda w: channels_of_folder(w.channels),
        # Hurt version -> the healthy clip from which it is made.
        sources=lambda w: datasets.sources(
            datasets.splits_in_shard(
                w.dataset, channels_of_folder(w.channels), int(w.shard)
            )
        ),
        # Training uses every n-th row of hurt versions; this is n.
        every=lambda w: datasets.hurt_row_step(w.dataset),
        options=lambda w: datasets.options_of_class(w.dataset, "database", Merging),
        code=lambda w: package.code(
            "database_shard", *channel_packages(channels_of_folder(w.channels))
        ),
    script:
        "../scripts/database_shard.py"


rule database_merge:
    """The database: the rows of all clips, shuffled and split into chunks, and statistics of their columns."""
    input:
        clips=lambda w: (
            []
            if shards_of(w)
            else clips_of(w.dataset, w.channels, "database/clips/{clip}.npz")
        ),
        # To check that no motion is both trained on and held out.
        compared=lambda w: (
            [] if shards_of(w) else compared_files(w, "motion/{clip}.npz")
        ),
        reports=lambda w: (
            [] if shards_of(w) else compared_files(w, "motion/{clip}.json")
        ),
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
        # .1 s for each thousand frames.
        runtime=lambda w, attempt: demands.shard_minutes(w.dataset, 0.1, attempt),
    params:
        dataset=lambda w: w.dataset,
        # Clip -> "train" or "held_out".
        splits=lambda w: datasets.splits(w.dataset, channels_of_folder(w.channels)),
        channels=lambda w: channels_of_folder(w.channels),
        # Hurt version -> the healthy clip from which it is made.
        sources=lambda w: datasets.sources(
            datasets.splits(w.dataset, channels_of_folder(w.channels))
        ),
        # Training uses every n-th row of hurt versions; this is n.
        every=lambda w: datasets.hurt_row_step(w.dataset),
        options=lambda w: datasets.options_of_class(w.dataset, "database", Merging),
        code=lambda w: package.code(
            "database_merge", *channel_packages(channels_of_folder(w.channels))
        ),
    script:
        "../scripts/database_merge.py"
