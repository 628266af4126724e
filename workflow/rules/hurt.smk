from hobble.hurt import HURT_CHANNEL


rule hurt_clips:
    """Hurt versions of healthy clips, with their labels and severities, and the mirrors of these versions."""
    input:
        batches=lambda w: dataset(w).folders(batch_of(w).originals, "motion", "labels"),
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
                "turn": dataset(w).hurt_versions[clip],
                "ground": dataset(w).entry(clip).ground,
                # `every` is left out, because only the database depends on it.
                "options": dataset(w)
                .hurt_options(clip)
                .model_dump(mode="json", exclude={"every"}),
            }
            for clip in batch_of(w).clips
        ],
        mirrored=lambda w: batch_of(w).mirrored,
        code=lambda w: package.code("hurt_clips", f"hobble.channels.{HURT_CHANNEL}"),
    script:
        "../scripts/hurt_clips.py"
