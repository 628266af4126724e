# Objects such as `clips`, `datasets` and `demands` are made in the Snakefile.

# A batch is a set of clips that one job processes. Each batch has its own rule.
for batch in batches_of_hurt_versions:

    rule:
        """Hurt versions of healthy clips, with their labels and severities, and the mirrors of these versions."""
        name:
            batch.rule("hurt_clips")
        input:
            clip=batch.of_originals("motion/{clip}.npz"),
            report=batch.of_originals("motion/{clip}.json"),
            labels=batch.of_originals("labels/{clip}.npz"),
            label_report=batch.of_originals("labels/{clip}.json"),
        output:
            clip=batch.of_clips("motion/{clip}.npz"),
            report=batch.of_clips("motion/{clip}.json"),
            labels=batch.of_clips("labels/{clip}.npz"),
            label_report=batch.of_clips("labels/{clip}.json"),
            injury=batch.of_clips("channels/injury/{clip}.npz"),
            injury_report=batch.of_clips("channels/injury/{clip}.json"),
            mirror_clip=batch.of_mirrors("motion/{clip}.npz"),
            mirror_report=batch.of_mirrors("motion/{clip}.json"),
            mirror_labels=batch.of_mirrors("labels/{clip}.npz"),
            mirror_label_report=batch.of_mirrors("labels/{clip}.json"),
            mirror_injury=batch.of_mirrors("channels/injury/{clip}.npz"),
            mirror_injury_report=batch.of_mirrors("channels/injury/{clip}.json"),
        log:
            batch.log("motion", "hurt_clips"),
        benchmark:
            batch.benchmark("motion", "hurt_clips")
        threads: 1
        resources:
            # The numbers below are MB and seconds for each thousand frames.
            mem_mb=lambda w, attempt, batch=batch: demands.batch_memory(
                batch, 20, attempt
            ),
            runtime=lambda w, attempt, batch=batch: demands.batch_minutes(
                batch, 0.7, attempt
            ),
        params:
            # One dictionary for each clip, which is a piece of the job: see hobble.workflow.batch_job.
            per_clip=lambda w, batch=batch: [
                {
                    "clip": clip,
                    # The number of the version among all versions of the data set. It decides which links hurt first.
                    "turn": clips.hurt_versions(batch.dataset)[clip],
                    "ground": clips.entry(batch.dataset, clip).ground,
                    # `every` is left out, because only the database depends on it.
                    "options": clips.hurt_options(batch.dataset, clip).model_dump(
                        mode="json", exclude={"every"}
                    ),
                }
                for clip in batch.clips
            ],
            code=lambda w: package.code(
                "hurt_clips", *channel_packages([clips.hurt_channel])
            ),
        script:
            "../scripts/hurt_clips.py"
