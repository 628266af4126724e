# Objects such as `clips`, `datasets` and `demands` are made in the Snakefile.

# A batch is a set of clips that one job processes. Each batch has its own rule.
for batch in batches_of_synthetic_clips:

    rule:
        """Clips of a synthetic walker, as BVH and label files like those of a user."""
        name:
            batch.rule("synthetic_clips")
        input:
            skeleton=lambda w, batch=batch: keep_local(
                clips.skeleton_file(batch.dataset)
            ),
        output:
            bvh=batch.of_clips("synthetic/{clip}.bvh"),
            footsteps=batch.of_clips("synthetic/{clip}_footsteps.txt"),
            gait=batch.of_clips("synthetic/{clip}_gait.txt"),
        log:
            batch.log("synthetic", "synthetic_clips"),
        benchmark:
            batch.benchmark("synthetic", "synthetic_clips")
        threads: 1
        resources:
            # The numbers below are MB and seconds for each thousand frames.
            mem_mb=lambda w, attempt, batch=batch: demands.batch_memory(
                batch, 13, attempt
            ),
            runtime=lambda w, attempt, batch=batch: demands.batch_minutes(
                batch, 0.2, attempt
            ),
        params:
            # One dictionary for each clip, which is a piece of the job: see hobble.workflow.batch_job.
            per_clip=lambda w, batch=batch: [
                {
                    "clip": clip,
                    "frames": datasets.frames(batch.dataset, clip),
                    "recipe": clips.entry(batch.dataset, clip).recipe,
                    "ground": clips.entry(batch.dataset, clip).ground,
                }
                for clip in batch.clips
            ],
            options=lambda w, batch=batch: datasets.options(batch.dataset, "synthetic"),
            code=lambda w: package.code("synthetic_clips"),
        script:
            "../scripts/synthetic_clips.py"
