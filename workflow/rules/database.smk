from hobble.database.options import Merging, RowOptions
from hobble.workflow.clips import channels_of_folder


rule database_clips:
    """The rows of clips and their mirrors. A row holds the input X, output Y and phase P of one frame."""
    input:
        batches=folders("motion", "labels", "channels", "terrain"),
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
        channels=lambda w: datasets.channel_sources.channels(w.dataset),
        options=lambda w: datasets.options_of_class(w.dataset, "database", RowOptions),
        code=lambda w: package.code(
            "database_clips",
            *channel_packages(datasets.channel_sources.channels(w.dataset)),
        ),
    script:
        "../scripts/database_clips.py"


def splits_of(w):
    """Clip -> "train" or "held_out", for the clips of a database or of one of its shards.

    A shard is the part of a database that one job makes from some of the clips.
    """
    channels = channels_of_folder(w.channels)
    if hasattr(w, "shard"):
        return datasets.splits_in_shard(w.dataset, channels, int(w.shard))
    return datasets.splits(w.dataset, channels)


def compared_clips(w):
    """The clips that are compared with the others, so that no motion is both trained on and held out."""
    names = datasets.clips_to_compare(w.dataset, channels_of_folder(w.channels))
    return [name for name in names if name in splits_of(w)]


def rows_and_compared(w):
    """The folders with the rows of a database's clips, and those with the motion that is compared."""
    return [
        *batches.folders(w.dataset, splits_of(w), "database"),
        *batches.folders(w.dataset, compared_clips(w), "motion"),
    ]


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
        batches=rows_and_compared,
    output:
        shard=directory("results/datasets/{dataset}/database/shards/{channels}/{shard}"),
    log:
        "results/datasets/{dataset}/logs/database/database_shard/{channels}-{shard}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/database/database_shard/{channels}-{shard}.tsv"
    resources:
        mem_mb=lambda w, attempt: demands.shard_memory(w.dataset, attempt),
        runtime=lambda w, attempt: demands.shard_minutes(w.dataset, attempt),
    params:
        splits=splits_of,
        compared=compared_clips,
        channels=lambda w: channels_of_folder(w.channels),
        # Hurt version -> the healthy clip from which it is made.
        sources=lambda w: datasets.sources(splits_of(w)),
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
        batches=lambda w: [] if shards_of(w) else rows_and_compared(w),
        shards=shards_of,
    output:
        database=directory("results/datasets/{dataset}/database/{channels}"),
    log:
        "results/datasets/{dataset}/logs/database/database_merge/{channels}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/database/database_merge/{channels}.tsv"
    resources:
        mem_mb=lambda w, attempt: demands.shard_memory(w.dataset, attempt),
        runtime=lambda w, attempt: demands.shard_minutes(w.dataset, attempt),
    params:
        dataset=lambda w: w.dataset,
        splits=splits_of,
        compared=lambda w: [] if shards_of(w) else compared_clips(w),
        channels=lambda w: channels_of_folder(w.channels),
        # As in the rule `database_shard`.
        sources=lambda w: datasets.sources(splits_of(w)),
        every=lambda w: datasets.hurt_row_step(w.dataset),
        options=lambda w: datasets.options_of_class(w.dataset, "database", Merging),
        code=lambda w: package.code(
            "database_merge", *channel_packages(channels_of_folder(w.channels))
        ),
    script:
        "../scripts/database_merge.py"
