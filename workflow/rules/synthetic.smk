rule synthetic_clips:
    """A clip of a synthetic walker, as BVH and label files like those of a user."""
    input:
        skeleton=lambda w: keep_local(dataset(w).skeleton_file),
    output:
        bvh="results/datasets/{dataset}/synthetic/{clip}.bvh",
        footsteps="results/datasets/{dataset}/synthetic/{clip}_footsteps.txt",
        gait="results/datasets/{dataset}/synthetic/{clip}_gait.txt",
    log:
        "results/datasets/{dataset}/logs/synthetic/synthetic_clips/{clip}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/synthetic/synthetic_clips/{clip}.tsv"
    resources:
        mem_mb=memory("synthetic"),
        runtime=minutes("synthetic"),
    params:
        clip=lambda w: w.clip,
        frames=lambda w: dataset(w).frames(w.clip),
        recipe=lambda w: dataset(w).entry(w.clip).recipe,
        options=lambda w: plain(dataset(w).settings, "synthetic"),
        code=lambda w: package.code("synthetic_clips"),
    script:
        "../scripts/synthetic_clips.py"
