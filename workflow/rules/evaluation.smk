rule measure:
    """The results of one measurement of a network, as JSON and CSV tables. hobble.measures has the measurements."""
    input:
        unpack(lambda w: keep_local(measurements.inputs(w.configuration, w.measure))),
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
        measured=lambda w: measurements.params(w.configuration, w.measure),
        code=lambda w: measurements.code(
            w.measure, configurations.model_package(w.configuration)
        ),
    script:
        "../scripts/measure.py"


rule compare:
    """The comparison of configurations with each other and with published results, as JSON and as CSV tables."""
    input:
        unpack(lambda w: comparison.input_files()),
        published=keep_local(package.published_file()),
    output:
        json="results/compare/compare.json",
        tables=directory("results/compare/tables"),
    log:
        "results/compare/logs/evaluation/compare.log",
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        configurations=lambda w: comparison.names(),
        code=package.code("compare", *measurements.shown_modules()),
    script:
        "../scripts/compare.py"
