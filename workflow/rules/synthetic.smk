for batch in batches_of_walker:

    rule:
        """Synthetic clips of a walker, in the same form as a user's clips."""
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
            mem_mb=lambda w, attempt, batch=batch: demands.batch_memory(
                batch, 13, attempt
            ),
            runtime=lambda w, attempt, batch=batch: demands.batch_minutes(
                batch, 0.2, attempt
            ),
        params:
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
