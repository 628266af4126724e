from hobble.hurt.options import HURT_CHANNEL


rule hurt_clips:
    """Hurt versions of healthy clips, with their labels and severities, and the mirrors of these versions."""
    input:
        batches=lambda w: batches.folders(
            w.dataset, batch_of(w).originals, "motion", "labels"
        ),
    output:
        batch=directory("results/datasets/{dataset}/batches/hurt/{batch}"),
    log:
        "results/datasets/{dataset}/logs/motion/hurt_clips/{batch}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/motion/hurt_clips/{batch}.tsv"
    resources:
        mem_mb=memory("hurt"),
        runtime=minutes("hurt"),
    params:
        clips=lambda w: [
            {
                "clip": clip,
                # The number of the version among all versions of the data set. It decides which links hurt first.
                "turn": clips.hurt_versions(w.dataset)[clip],
                "ground": clips.entry(w.dataset, clip).ground,
                # `every` is left out, because only the database depends on it.
                "options": clips.hurt_options(w.dataset, clip).model_dump(
                    mode="json", exclude={"every"}
                ),
            }
            for clip in batch_of(w).clips
        ],
        mirrored=lambda w: batch_of(w).mirrored,
        code=lambda w: package.code("hurt_clips", *channel_packages([HURT_CHANNEL])),
    script:
        "../scripts/hurt_clips.py"
