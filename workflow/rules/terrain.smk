# Objects such as `clips`, `datasets` and `demands` are made in the Snakefile.

from hobble.terrain.options import PatchOptions, FitOptions, HeightSampling


rule terrain_patches:
    """Patches of ground, cut from random places of the heightmaps."""
    input:
        files=lambda w: keep_local(clips.heightmap_files(w.dataset)),
    output:
        patches="results/datasets/{dataset}/terrain/patches.npz",
    log:
        "results/datasets/{dataset}/logs/terrain/terrain_patches.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/terrain/terrain_patches.tsv"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        options=lambda w: datasets.options_of_class(w.dataset, "terrain", PatchOptions),
        code=package.code("terrain_patches"),
    script:
        "../scripts/terrain_patches.py"


# A batch is a set of clips that one job processes. Each batch has its own rule.
for batch in [*batches_of_clips, *batches_of_hurt_versions]:

    rule:
        """The patches that fit each gait cycle of a clip best, and their heights along the path of the cycle."""
        name:
            batch.rule("terrain_fits")
        input:
            clip=batch.of_names("motion/{clip}.npz"),
            labels=batch.of_names("labels/{clip}.npz"),
            patches=f"results/datasets/{batch.dataset}/terrain/patches.npz",
        output:
            fits=batch.of_names("terrain/clips/{clip}.npz"),
        log:
            batch.log("terrain", "terrain_fits"),
        benchmark:
            batch.benchmark("terrain", "terrain_fits")
        threads: 1
        resources:
            # The numbers below are MB and seconds for each thousand frames.
            mem_mb=lambda w, attempt, batch=batch: demands.batch_memory(
                batch, 15, attempt
            ),
            runtime=lambda w, attempt, batch=batch: demands.batch_minutes(
                batch, 0.3 * (1 + batch.mirrored), attempt, least=3
            ),
        params:
            # One dictionary for each clip, which is a piece of the job: see hobble.workflow.batch_job.
            per_clip=lambda w, batch=batch: [
                {"clip": name, "ground": clips.entry(batch.dataset, name).ground}
                for name in batch.names
            ],
            options=lambda w, batch=batch: datasets.options_of_class(
                batch.dataset, "terrain", FitOptions
            ),
            sampling=lambda w, batch=batch: datasets.options_of_class(
                batch.dataset, "database", HeightSampling
            ),
            code=lambda w: package.code("terrain_fits"),
        script:
            "../scripts/terrain_fits.py"
