# This rule has no param `code`: if the checksum is right, it does not matter which code downloaded the file.
rule download_clip:
    """A clip that is not in the user's folder, downloaded from the data set's address."""
    output:
        bvh=local(str(DOWNLOADED / "{dataset}" / "{clip}.bvh")),
    log:
        "results/datasets/{dataset}/logs/motion/download_clip/{clip}.log",
    localrule: True
    resources:
        mem_mb=500,
        runtime=10,
    params:
        url=lambda w: dataset(w).download(w.clip)["url"],
        sha256=lambda w: dataset(w).download(w.clip)["sha256"],
        folder=lambda w: dataset(w).download(w.clip)["folder"],
    script:
        "../scripts/download_clip.py"


rule motion_clips:
    """Clips made from BVH files: checked, retargeted to the data set's skeleton, at 60 Hz. Also their mirrors."""
    input:
        files=local_files(motion_inputs),
        skeleton=lambda w: keep_local(dataset(w).skeleton_file),
    output:
        batch=directory("results/datasets/{dataset}/batches/motion/{batch}"),
    log:
        "results/datasets/{dataset}/logs/motion/motion_clips/{batch}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/motion/motion_clips/{batch}.tsv"
    resources:
        mem_mb=memory("motion"),
        runtime=minutes("motion"),
    params:
        clips=lambda w: [
            {
                "clip": clip,
                "options": dataset(w).motion_options(clip),
                "files": motion_files(w, clip),
            }
            for clip in batch_of(w).clips
        ],
        contents=contents_of(motion_inputs),
        mirrored=lambda w: batch_of(w).mirrored,
        skeleton_name=lambda w: dataset(w).settings.skeleton,
        # The folder of skeleton files. They map the joints of one rig to those of another.
        maps=str(project.base / "config" / "skeletons"),
        code=lambda w: package.code("motion_clips"),
    script:
        "../scripts/motion_clips.py"


rule clip_file:
    """One file of a clip, for a user who asks for it by its name. (A job makes the files of a whole batch.)"""
    input:
        batches=lambda w: dataset(w).folders(
            [w.clip],
            {"terrain/clips": "terrain"}.get(w.place, w.place.partition("/")[0]),
        ),
    output:
        file="results/datasets/{dataset}/{place}/{clip}.{kind}",
    log:
        "results/datasets/{dataset}/logs/motion/clip_file/{place}/{clip}.{kind}.log",
    wildcard_constraints:
        place="motion|labels|channels/[a-z_]+|terrain/clips|database/clips",
        kind="npz|json",
    localrule: True
    params:
        name=lambda w: f"{w.place}/{w.clip}.{w.kind}",
    script:
        "../scripts/clip_file.py"
