# Objects such as `clips`, `datasets` and `demands` are made in the Snakefile.


def for_listed_clips(dataset, file):
    """The path `file`, which contains {clip}, for each clip that the data set lists.

    If it lists none, these are the clips in its folder.
    """
    return [
        f"results/datasets/{dataset}/{file}".format(clip=clip)
        for clip in clips.listed_entries(dataset)
    ]


# A batch is a set of clips that one job processes. Each batch has its own rule.
for batch in batches_of_clips:

    rule:
        """Contacts, phase and gait of clips and their mirrors. Label files beside a clip are used if there are any."""
        name:
            batch.rule("labels_clips")
        input:
            clip=batch.of_clips("motion/{clip}.npz"),
            report=batch.of_clips("motion/{clip}.json"),
            mirror=batch.of_mirrors("motion/{clip}.npz"),
            files=lambda w, batch=batch: files_of_batch(batch, clips.label_files),
        output:
            labels=batch.of_clips("labels/{clip}.npz"),
            report=batch.of_clips("labels/{clip}.json"),
            mirror=batch.of_mirrors("labels/{clip}.npz"),
            mirror_report=batch.of_mirrors("labels/{clip}.json"),
        log:
            batch.log("labels", "labels_clips"),
        benchmark:
            batch.benchmark("labels", "labels_clips")
        threads: 1
        resources:
            # The numbers below are MB and seconds for each thousand frames.
            mem_mb=lambda w, attempt, batch=batch: demands.batch_memory(
                batch, 5, attempt
            ),
            runtime=lambda w, attempt, batch=batch: demands.batch_minutes(
                batch, 0.25, attempt
            ),
        params:
            # One dictionary for each clip, which is a piece of the job: see hobble.workflow.batch_job.
            per_clip=lambda w, batch=batch: [
                {
                    "clip": clip,
                    "gait": clips.entry(batch.dataset, clip).gait,
                    "ground": clips.entry(batch.dataset, clip).ground,
                }
                for clip in batch.clips
            ],
            # Name of an input -> the number of its files for each clip.
            files_per_clip=lambda w, batch=batch: {
                "files": file_counts(batch, clips.label_files)
            },
            options=lambda w, batch=batch: datasets.options(batch.dataset, "labels"),
            code=lambda w: package.code("labels_clips"),
        script:
            "../scripts/labels_clips.py"


rule look_page:
    """A page with one line for each clip of a data set: rig, frame rate, cadence, gaits, warnings."""
    input:
        clips=lambda w: for_listed_clips(w.dataset, "motion/{clip}.npz"),
        reports=lambda w: for_listed_clips(w.dataset, "motion/{clip}.json"),
        labels=lambda w: for_listed_clips(w.dataset, "labels/{clip}.json"),
        contacts=lambda w: for_listed_clips(w.dataset, "labels/{clip}.npz"),
        # The page does not show channels. They are inputs so that a user who asks for the page learns of mistakes in
        # their files.
        channels=lambda w: [
            file
            for channel in datasets.channel_sources.channels(w.dataset)
            for file in for_listed_clips(
                w.dataset, f"channels/{channel}/{{clip}}.json"
            )
        ],
    output:
        html="results/datasets/{dataset}/look.html",
    log:
        "results/datasets/{dataset}/logs/labels/look_page.log",
    resources:
        # 10 MB for each thousand frames of the longest clip, 24 bytes for each frame of all clips, and .1 s for each
        # thousand frames.
        mem_mb=lambda w, attempt: demands.memory_of_longest(w.dataset, 10, 24, attempt),
        runtime=lambda w, attempt: demands.minutes_of_all(
            w.dataset, 0.1, attempt, least=5
        ),
    params:
        dataset=lambda w: w.dataset,
        code=package.code("look_page"),
    script:
        "../scripts/look_page.py"
