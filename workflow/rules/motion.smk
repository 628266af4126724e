# No `code` here: if the checksum is right, it does not matter which code downloaded the file.
rule download_clip:
    """A clip that is not in the user's folder, downloaded from the data set's address."""
    output:
        bvh=local(clips.downloaded("{dataset}", "{clip}")),
    log:
        "results/datasets/{dataset}/logs/motion/download_clip/{clip}.log",
    localrule: True
    resources:
        mem_mb=500,
        runtime=10,
    params:
        url=lambda w: clips.download(w.dataset, w.clip)["url"],
        sha256=lambda w: clips.download(w.dataset, w.clip)["sha256"],
        folder=lambda w: clips.download(w.dataset, w.clip)["folder"],
    script:
        "../scripts/download_clip.py"


rule motion_clip:
    """A clip from its BVH file: checked, on the data set's skeleton, at 60 Hz."""
    input:
        bvh=lambda w: keep_local(clips.source(w.dataset, w.clip)),
        skeleton=lambda w: keep_local(clips.skeleton_file(w.dataset)),
        rig=lambda w: clips.rig_files(w.dataset, w.clip),
    output:
        clip="results/datasets/{dataset}/motion/{clip}.npz",
        report="results/datasets/{dataset}/motion/{clip}.json",
    log:
        "results/datasets/{dataset}/logs/motion/motion_clip/{clip}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/motion/motion_clip/{clip}.tsv"
    wildcard_constraints:
        clip=LISTED_CLIP,
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.memory(w.dataset, w.clip, 13, attempt),
        runtime=lambda w, attempt: demands.minutes(w.dataset, w.clip, 0.2, attempt),
    params:
        clip=lambda w: w.clip,
        skeleton_name=lambda w: catalogue.dataset(w.dataset).skeleton,
        maps=clips.skeletons,
        options=lambda w: datasets.motion_options(w.dataset, w.clip),
        code=package.code("motion_clip"),
    script:
        "../scripts/motion_clip.py"


rule motion_mirror:
    """The clip with left and right swapped."""
    input:
        clip="results/datasets/{dataset}/motion/{clip}.npz",
        report="results/datasets/{dataset}/motion/{clip}.json",
    output:
        clip="results/datasets/{dataset}/motion/{clip}_mirror.npz",
        report="results/datasets/{dataset}/motion/{clip}_mirror.json",
    log:
        "results/datasets/{dataset}/logs/motion/motion_mirror/{clip}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/motion/motion_mirror/{clip}.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.memory(w.dataset, w.clip, 4, attempt),
        runtime=lambda w, attempt: demands.minutes(w.dataset, w.clip, 0.1, attempt),
    params:
        clip=lambda w: f"{w.clip}_mirror",
        code=package.code("motion_mirror"),
    script:
        "../scripts/motion_mirror.py"
