from hobble.terrain import PatchOptions, FitOptions, HeightSampling


rule terrain_patches:
    """Patches of ground, cut from random places of the heightmaps."""
    input:
        files=local_files(heightmap_inputs),
    output:
        patches="results/datasets/{dataset}/terrain/patches.npz",
    log:
        "results/datasets/{dataset}/logs/terrain/terrain_patches.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/terrain/terrain_patches.tsv"
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        contents=contents_of(heightmap_inputs),
        options=lambda w: plain(
            dataset(w).settings, "terrain", PatchOptions.model_fields
        ),
        code=lambda w: package.code("terrain_patches"),
    script:
        "../scripts/terrain_patches.py"


rule terrain_fits:
    """The patches that fit each gait cycle of a clip best, and their heights along the path of the cycle."""
    input:
        batches=folders("motion", "labels"),
        patches=rules.terrain_patches.output.patches,
    output:
        batch=directory("results/datasets/{dataset}/batches/terrain/{batch}"),
    log:
        "results/datasets/{dataset}/logs/terrain/terrain_fits/{batch}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/terrain/terrain_fits/{batch}.tsv"
    resources:
        mem_mb=memory("terrain"),
        runtime=minutes("terrain"),
    params:
        clips=lambda w: [
            {"clip": name, "ground": dataset(w).entry(name).ground}
            for name in batch_of(w).names
        ],
        options=lambda w: plain(dataset(w).settings, "terrain", FitOptions.model_fields),
        sampling=lambda w: plain(
            dataset(w).settings, "database", HeightSampling.model_fields
        ),
        code=lambda w: package.code("terrain_fits"),
    script:
        "../scripts/terrain_fits.py"
