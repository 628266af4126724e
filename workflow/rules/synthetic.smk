rule synthetic_clip:
    """One clip of the embedded walker, in the same form as a user's clip."""
    input:
        skeleton=lambda w: keep_local(clips.skeleton_file(w.dataset)),
    output:
        bvh="results/datasets/{dataset}/synthetic/{clip}.bvh",
        footsteps="results/datasets/{dataset}/synthetic/{clip}_footsteps.txt",
        gait="results/datasets/{dataset}/synthetic/{clip}_gait.txt",
    log:
        "results/datasets/{dataset}/logs/synthetic/synthetic_clip/{clip}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/synthetic/synthetic_clip/{clip}.tsv"
    wildcard_constraints:
        clip=LISTED_CLIP,
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.memory(w.dataset, w.clip, 13, attempt),
        runtime=lambda w, attempt: demands.minutes(w.dataset, w.clip, 0.2, attempt),
    params:
        clip=lambda w: w.clip,
        frames=lambda w: datasets.frames(w.dataset, w.clip),
        recipe=lambda w: clips.entry(w.dataset, w.clip).recipe,
        ground=lambda w: clips.entry(w.dataset, w.clip).ground,
        options=lambda w: datasets.options(w.dataset, "synthetic"),
        code=package.code("synthetic_clip"),
    script:
        "../scripts/synthetic_clip.py"
