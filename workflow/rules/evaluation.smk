rule measure:
    """The results of one measurement of a network, as JSON and CSV tables. hobble.measures has the measurements."""
    input:
        unpack(lambda w: keep_local(configuration(w).measure_inputs(w.measure))),
    output:
        json="results/{configuration}/evaluation/{measure}.json",
        tables=directory("results/{configuration}/evaluation/{measure}"),
    log:
        "results/{configuration}/logs/evaluation/{measure}.log",
    benchmark:
        "results/{configuration}/benchmarks/evaluation/{measure}.tsv"
    resources:
        mem_mb=memory("measure"),
        runtime=minutes("measure"),
    params:
        measured=lambda w: configuration(w).measure_params(w.measure),
        code=lambda w: package.code(
            "measure",
            measure_named(w.measure).run_module,
            configuration(w).model_package,
        ),
    script:
        "../scripts/measure.py"


rule compare:
    """The comparison of configurations with each other and with published results, as JSON and as CSV tables."""
    input:
        unpack(lambda w: comparison_files()),
        published=keep_local(str(project.base / PUBLISHED)),
    output:
        json="results/compare/compare.json",
        tables=directory("results/compare/tables"),
    log:
        "results/compare/logs/evaluation/compare.log",
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        configurations=lambda w: [each.name for each in project.compared],
        code=package.code("compare", *SHOWN),
    script:
        "../scripts/compare.py"
