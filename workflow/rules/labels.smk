rule labels_clip:
    """Contacts, phase and gait of a clip, from hand-made files where there are any."""
    input:
        clip="results/datasets/{dataset}/motion/{clip}.npz",
        report="results/datasets/{dataset}/motion/{clip}.json",
        files=lambda w: kept(clips.label_files(w.dataset, w.clip)),
    output:
        labels="results/datasets/{dataset}/labels/{clip}.npz",
        report="results/datasets/{dataset}/labels/{clip}.json",
    log:
        "results/datasets/{dataset}/logs/labels/labels_clip/{clip}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/labels/labels_clip/{clip}.tsv"
    wildcard_constraints:
        clip=OWN,
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.memory(w.dataset, w.clip, 5, attempt),
        runtime=lambda w, attempt: demands.minutes(w.dataset, w.clip, 0.15, attempt),
    params:
        clip=lambda w: w.clip,
        gait=lambda w: clips.entry(w.dataset, w.clip).gait,
        ground=lambda w: clips.entry(w.dataset, w.clip).ground,
        options=lambda w: datasets.options(w.dataset, "labels"),
        code=package.code("labels_clip"),
    script:
        "../scripts/labels_clip.py"


rule labels_mirror:
    """The labels of a mirrored clip: the other foot, half a cycle on."""
    input:
        labels="results/datasets/{dataset}/labels/{clip}.npz",
        report="results/datasets/{dataset}/labels/{clip}.json",
        clip="results/datasets/{dataset}/motion/{clip}_mirror.npz",
    output:
        labels="results/datasets/{dataset}/labels/{clip}_mirror.npz",
        report="results/datasets/{dataset}/labels/{clip}_mirror.json",
    log:
        "results/datasets/{dataset}/logs/labels/labels_mirror/{clip}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/labels/labels_mirror/{clip}.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.memory(w.dataset, w.clip, 4, attempt),
        runtime=lambda w, attempt: demands.minutes(w.dataset, w.clip, 0.1, attempt),
    params:
        clip=lambda w: f"{w.clip}_mirror",
        options=lambda w: datasets.options(w.dataset, "labels"),
        code=package.code("labels_mirror"),
    script:
        "../scripts/labels_mirror.py"
