rule injury_clip:
    """How much each link hurts in each frame."""
    input:
        clip="results/datasets/{dataset}/motion/{clip}.npz",
        report="results/datasets/{dataset}/motion/{clip}.json",
        status=lambda w: kept(clips.status_files(w.dataset, w.clip)),
    output:
        injury="results/datasets/{dataset}/injury/{clip}.npz",
        report="results/datasets/{dataset}/injury/{clip}.json",
    log:
        "results/datasets/{dataset}/logs/injury/injury_clip/{clip}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/injury/injury_clip/{clip}.tsv"
    wildcard_constraints:
        clip=OWN,
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.memory(w.dataset, w.clip, 4, attempt),
        runtime=lambda w, attempt: demands.minutes(w.dataset, w.clip, 0.1, attempt),
    params:
        clip=lambda w: w.clip,
        status=lambda w: clips.entry(w.dataset, w.clip).status,
        options={},
        code=package.code("injury_clip"),
    script:
        "../scripts/injury_clip.py"


rule injury_mirror:
    """The severities of a mirrored clip."""
    input:
        injury="results/datasets/{dataset}/injury/{clip}.npz",
        report="results/datasets/{dataset}/injury/{clip}.json",
        clip="results/datasets/{dataset}/motion/{clip}_mirror.npz",
    output:
        injury="results/datasets/{dataset}/injury/{clip}_mirror.npz",
        report="results/datasets/{dataset}/injury/{clip}_mirror.json",
    log:
        "results/datasets/{dataset}/logs/injury/injury_mirror/{clip}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/injury/injury_mirror/{clip}.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.memory(w.dataset, w.clip, 4, attempt),
        runtime=lambda w, attempt: demands.minutes(w.dataset, w.clip, 0.1, attempt),
    params:
        clip=lambda w: f"{w.clip}_mirror",
        code=package.code("injury_mirror"),
    script:
        "../scripts/injury_mirror.py"
