rule hurt_clip:
    """A hurt version of a healthy clip, with its labels and severities."""
    input:
        clip="results/datasets/{dataset}/motion/{clip}.npz",
        report="results/datasets/{dataset}/motion/{clip}.json",
        labels="results/datasets/{dataset}/labels/{clip}.npz",
        label_report="results/datasets/{dataset}/labels/{clip}.json",
    output:
        clip="results/datasets/{dataset}/motion/{clip}_hurt{version}.npz",
        report="results/datasets/{dataset}/motion/{clip}_hurt{version}.json",
        labels="results/datasets/{dataset}/labels/{clip}_hurt{version}.npz",
        label_report="results/datasets/{dataset}/labels/{clip}_hurt{version}.json",
        injury="results/datasets/{dataset}/channels/injury/{clip}_hurt{version}.npz",
        injury_report="results/datasets/{dataset}/channels/injury/{clip}_hurt{version}.json",
    log:
        "results/datasets/{dataset}/logs/motion/hurt_clip/{clip}_hurt{version}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/motion/hurt_clip/{clip}_hurt{version}.tsv"
    wildcard_constraints:
        clip=LISTED_CLIP,
        version="[1-9]",
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.memory(w.dataset, w.clip, 20, attempt),
        runtime=lambda w, attempt: demands.minutes(w.dataset, w.clip, 0.4, attempt),
    params:
        clip=lambda w: f"{w.clip}_hurt{w.version}",
        turn=lambda w: clips.hurt_versions(w.dataset)[f"{w.clip}_hurt{w.version}"],
        ground=lambda w: clips.entry(w.dataset, w.clip).ground,
        options=lambda w: clips.hurt(w.dataset, w.clip).model_dump(mode="json"),
        code=package.code("hurt_clip"),
    script:
        "../scripts/hurt_clip.py"
