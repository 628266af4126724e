def for_listed_clips(dataset, file):
    """The path `file` for each clip that the data set lists or that is in its folder."""
    return [
        f"results/datasets/{dataset}/{file}".format(clip=clip)
        for clip in clips.listed(dataset)
    ]


rule labels_clip:
    """Contacts, phase and gait of a clip, from label files beside it if there are any."""
    input:
        clip="results/datasets/{dataset}/motion/{clip}.npz",
        report="results/datasets/{dataset}/motion/{clip}.json",
        files=lambda w: keep_local(clips.label_files(w.dataset, w.clip)),
    output:
        labels="results/datasets/{dataset}/labels/{clip}.npz",
        report="results/datasets/{dataset}/labels/{clip}.json",
    log:
        "results/datasets/{dataset}/logs/labels/labels_clip/{clip}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/labels/labels_clip/{clip}.tsv"
    wildcard_constraints:
        clip=LISTED_CLIP,
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
    """The labels of a mirrored clip: feet swapped, phase shifted by half a cycle."""
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


rule look_page:
    """A page with one line for each clip of a data set: rig, rate, cadence, gaits, warnings."""
    input:
        clips=lambda w: for_listed_clips(w.dataset, "motion/{clip}.npz"),
        reports=lambda w: for_listed_clips(w.dataset, "motion/{clip}.json"),
        labels=lambda w: for_listed_clips(w.dataset, "labels/{clip}.json"),
        contacts=lambda w: for_listed_clips(w.dataset, "labels/{clip}.npz"),
    output:
        html="results/datasets/{dataset}/look.html",
    log:
        "results/datasets/{dataset}/logs/labels/look_page.log",
    resources:
        mem_mb=lambda w, attempt: demands.memory_of_longest(w.dataset, 10, 24, attempt),
        runtime=lambda w, attempt: demands.minutes_of_all(
            w.dataset, 0.1, attempt, least=5
        ),
    params:
        dataset=lambda w: w.dataset,
        code=package.code("look_page"),
    script:
        "../scripts/look_page.py"
