from hobble.terrain.options import Drawing, Fitting, Sampling


rule terrain_patches:
    """Patches of ground drawn from the heightmaps."""
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
        options=lambda w: datasets.part(w.dataset, "terrain", Drawing),
        code=package.code("terrain_patches"),
    script:
        "../scripts/terrain_patches.py"


rule terrain_fits:
    """The ten patches that fit each cycle of a clip best, and their heights under it."""
    input:
        clip="results/datasets/{dataset}/motion/{rows}.npz",
        labels="results/datasets/{dataset}/labels/{rows}.npz",
        patches="results/datasets/{dataset}/terrain/patches.npz",
    output:
        fits="results/datasets/{dataset}/terrain/clips/{rows}.npz",
    log:
        "results/datasets/{dataset}/logs/terrain/terrain_fits/{rows}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/terrain/terrain_fits/{rows}.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.memory(w.dataset, w.rows, 15, attempt),
        runtime=lambda w, attempt: demands.minutes(
            w.dataset, w.rows, 0.3, attempt, least=3
        ),
    params:
        clip=lambda w: w.rows,
        ground=lambda w: clips.entry(w.dataset, w.rows).ground,
        options=lambda w: datasets.part(w.dataset, "terrain", Fitting),
        sampling=lambda w: datasets.part(w.dataset, "database", Sampling),
        code=package.code("terrain_fits"),
    script:
        "../scripts/terrain_fits.py"
