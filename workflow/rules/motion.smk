# Objects such as `clips`, `datasets` and `demands` are made in the Snakefile.


# This rule has no param `code`: if the checksum is right, it does not matter which code downloaded the file.
rule download_clip:
    """A clip that is not in the user's folder, downloaded from the data set's address."""
    output:
        bvh=local(clips.download_path("{dataset}", "{clip}")),
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


# A batch is a set of clips that one job processes. Each batch has its own rule.
for batch in batches_of_clips:

    rule:
        """Clips made from BVH files: checked, retargeted to the data set's skeleton, at 60 Hz. Also their mirrors."""
        name:
            batch.rule("motion_clips")
        input:
            bvh=lambda w, batch=batch: keep_local(
                [clips.source(batch.dataset, clip) for clip in batch.clips]
            ),
            skeleton=lambda w, batch=batch: keep_local(
                clips.skeleton_file(batch.dataset)
            ),
            rigs=lambda w, batch=batch: files_of_batch(batch, clips.clip_skeleton_files),
        output:
            clip=batch.of_clips("motion/{clip}.npz"),
            report=batch.of_clips("motion/{clip}.json"),
            mirror=batch.of_mirrors("motion/{clip}.npz"),
            mirror_report=batch.of_mirrors("motion/{clip}.json"),
        log:
            batch.log("motion", "motion_clips"),
        benchmark:
            batch.benchmark("motion", "motion_clips")
        threads: 1
        resources:
            # The numbers below are MB and seconds for each thousand frames.
            mem_mb=lambda w, attempt, batch=batch: demands.batch_memory(
                batch, 13, attempt
            ),
            runtime=lambda w, attempt, batch=batch: demands.batch_minutes(
                batch, 0.3, attempt
            ),
        params:
            # One dictionary for each clip, which is a piece of the job: see hobble.workflow.batch_job.
            per_clip=lambda w, batch=batch: [
                {
                    "clip": clip,
                    "options": datasets.motion_options(batch.dataset, clip),
                }
                for clip in batch.clips
            ],
            # Name of an input -> the number of its files for each clip.
            files_per_clip=lambda w, batch=batch: {
                "rigs": file_counts(batch, clips.clip_skeleton_files)
            },
            skeleton_name=lambda w, batch=batch: catalogue.dataset(
                batch.dataset
            ).skeleton,
            # The folder of skeleton files. They map the joints of one rig to those of another.
            maps=clips.skeleton_folder,
            code=lambda w: package.code("motion_clips"),
        script:
            "../scripts/motion_clips.py"
