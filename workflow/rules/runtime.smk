rule generate:
    """The character walking, jogging, crouching and limping by itself, as BVH files."""
    input:
        weights=lambda w: project.network(w.configuration, "weights.npz"),
    output:
        scenarios="results/{configuration}/runtime/scenarios.npz",
        bvh=directory("results/{configuration}/runtime/bvh"),
    log:
        "results/{configuration}/logs/runtime/generate.log",
    benchmark:
        "results/{configuration}/benchmarks/runtime/generate.tsv"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        runtime=lambda w: project.section(w.configuration, "runtime"),
        code=project.code("generate"),
    script:
        "../scripts/generate.py"
