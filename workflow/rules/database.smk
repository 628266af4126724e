from hobble.database.options import Merging, Rows


rule database_clip:
    """The rows of X, Y and P of one clip."""
    input:
        clip="results/datasets/{dataset}/motion/{rows}.npz",
        labels="results/datasets/{dataset}/labels/{rows}.npz",
        channels=lambda w: [
            f"results/datasets/{w.dataset}/channels/{channel}/{w.rows}.npz"
            for channel in datasets.channel_sources.channels(w.dataset)
        ],
        terrain="results/datasets/{dataset}/terrain/clips/{rows}.npz",
    output:
        rows="results/datasets/{dataset}/database/clips/{rows}.npz",
        facts="results/datasets/{dataset}/database/clips/{rows}.json",
    log:
        "results/datasets/{dataset}/logs/database/database_clip/{rows}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/database/database_clip/{rows}.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.memory(w.dataset, w.rows, 22, attempt),
        runtime=lambda w, attempt: demands.minutes(w.dataset, w.rows, 0.15, attempt),
    params:
        clip=lambda w: w.rows,
        channels=lambda w: datasets.channel_sources.channels(w.dataset),
        options=lambda w: datasets.part(w.dataset, "database", Rows),
        code=lambda w: package.code(
            "database_clip", *modules_of(datasets.channel_sources.channels(w.dataset))
        ),
    script:
        "../scripts/database_clip.py"


rule database_merge:
    """The rows of all clips, shuffled, in chunks, with their statistics."""
    input:
        clips=lambda w: expand(
            f"results/datasets/{w.dataset}/database/clips/{{clip}}.npz",
            clip=datasets.selected(w.dataset, channels_of_folder(w.told)),
        ),
        # No motion may lie on both sides of the split.
        compared=lambda w: expand(
            f"results/datasets/{w.dataset}/motion/{{clip}}.npz",
            clip=datasets.compared(w.dataset, channels_of_folder(w.told)),
        ),
        reports=lambda w: expand(
            f"results/datasets/{w.dataset}/motion/{{clip}}.json",
            clip=datasets.compared(w.dataset, channels_of_folder(w.told)),
        ),
    output:
        database=directory("results/datasets/{dataset}/database/{told}"),
    log:
        "results/datasets/{dataset}/logs/database/database_merge/{told}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/database/database_merge/{told}.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.memory_of_longest(w.dataset, 10, 24, attempt),
        runtime=lambda w, attempt: demands.minutes_of_all(
            w.dataset, 0.1, attempt, least=5
        ),
    params:
        dataset=lambda w: w.dataset,
        splits=lambda w: datasets.selected(w.dataset, channels_of_folder(w.told)),
        channels=lambda w: channels_of_folder(w.told),
        sources=lambda w: datasets.sources(w.dataset, channels_of_folder(w.told)),
        options=lambda w: datasets.part(w.dataset, "database", Merging),
        code=lambda w: package.code(
            "database_merge", *modules_of(channels_of_folder(w.told))
        ),
    script:
        "../scripts/database_merge.py"
