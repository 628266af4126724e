rule page_bundle:
    """The scripts of the reports' pages and their npm packages, bundled into one file.

    The packages are downloaded in the versions of the lock file, beside the bundle, unless they are there.
    """
    input:
        packages=keep_local(package.files("report/web/*.json")),
        scripts=keep_local(package.files("report/web/*.js")),
        engine=keep_local(package.files("engine/examples/hobble.mjs")),
        wasm=rules.engine_wasm.output.wasm,
    output:
        js="results/page/bundle.js",
    log:
        "results/page/logs/report/page_bundle.log",
    localrule: True
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=package.code("page_bundle"),
    script:
        "../scripts/page_bundle.py"


rule configuration:
    """The configuration and its data set with every key, also those with default or inherited values."""
    output:
        yaml="results/{configuration}/configuration.yaml",
    log:
        "results/{configuration}/logs/report/configuration.log",
    resources:
        mem_mb=700,
        runtime=5,
    params:
        name=lambda w: w.configuration,
        base=str(project.base),
        # A hash of all these keys, so that the rule runs again if one changes.
        digest=lambda w: configuration(w).digest(),
        code=package.code("configuration"),
    script:
        "../scripts/configuration.py"


rule pipeline_summary:
    """The cost of each stage: seconds and memory from its benchmark files, bytes from its output files."""
    input:
        # The script does not read these inputs. They only make this rule run after the jobs whose costs it sums up.
        lambda w: configuration(w).result_files(),
        rules.generate.output.scenarios,
    output:
        json="results/{configuration}/pipeline.json",
    log:
        "results/{configuration}/logs/report/pipeline_summary.log",
    resources:
        mem_mb=700,
        runtime=5,
    params:
        configuration=lambda w: w.configuration,
        stages=lambda w: configuration(w).stages(),
        code=package.code("pipeline_summary"),
    script:
        "../scripts/pipeline_summary.py"


rule report:
    """The report of a configuration as one HTML file."""
    input:
        measurements=lambda w: configuration(w).result_files(),
        pipeline=rules.pipeline_summary.output.json,
        configuration=rules.configuration.output.yaml,
        weights=network_file("weights.npz"),
        history=network_file("history.csv"),
        batches=lambda w: configuration(w).folders(
            "motion", "labels", "channels", "terrain", "database"
        ),
        template=keep_local(PAGES),
        bundle=rules.page_bundle.output.js,
    output:
        html=report(
            "results/{configuration}/report.html",
            caption="../report/report.rst",
            category="Characters",
            labels={"configuration": "{configuration}"},
        ),
    log:
        "results/{configuration}/logs/report/report.log",
    benchmark:
        "results/{configuration}/benchmarks/report/report.tsv"
    resources:
        mem_mb=memory("report"),
        runtime=minutes("report"),
    params:
        configuration=lambda w: w.configuration,
        dataset=lambda w: configuration(w).dataset.name,
        splits=lambda w: configuration(w).splits,
        channels=lambda w: configuration(w).dataset.channels,
        title=lambda w: configuration(w).settings.report.title,
        code=network_code("report", *SHOWN, *display_modules()),
    script:
        "../scripts/report.py"


rule report_compare:
    """The page that compares configurations and shows the characters of two of them in the same world."""
    input:
        compared=rules.compare.output.json,
        configuration=lambda w: comparison_files()["configuration"],
        weights=lambda w: [each.network("weights.npz") for each in project.compared],
        template=keep_local(PAGES),
        bundle=rules.page_bundle.output.js,
    output:
        html=report(
            "results/compare/report.html",
            caption="../report/compare.rst",
            category="Comparison",
        ),
    log:
        "results/compare/logs/report/report_compare.log",
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        configurations=lambda w: [each.name for each in project.compared],
        code=package.code("report_compare", *SHOWN),
    script:
        "../scripts/report_compare.py"


rule stimuli:
    """Short looping films of the character's walk for each channel."""
    input:
        weights=network_file("weights.npz"),
    output:
        folder=directory("results/{configuration}/stimuli"),
    log:
        "results/{configuration}/logs/report/stimuli.log",
    benchmark:
        "results/{configuration}/benchmarks/report/stimuli.tsv"
    resources:
        mem_mb=1500,
        runtime=15,
    params:
        runtime=section("runtime"),
        code=network_code("stimuli", *display_modules()),
    script:
        "../scripts/stimuli.py"


rule questionnaire:
    """A page that shows thirteen films of the character and asks what hurts. The right answers are in films.json."""
    input:
        weights=network_file("weights.npz"),
        template=keep_local(PAGES),
    output:
        page="results/{configuration}/questionnaire/questionnaire.html",
        films="results/{configuration}/questionnaire/films.json",
    log:
        "results/{configuration}/logs/report/questionnaire.log",
    benchmark:
        "results/{configuration}/benchmarks/report/questionnaire.tsv"
    threads: 4
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        configuration=lambda w: w.configuration,
        parts=lambda w: configuration(w).settings.report.parts,
        runtime=section("runtime"),
        code=network_code("questionnaire", *display_modules()),
    script:
        "../scripts/questionnaire.py"


rule export_web:
    """The character for other web pages: an ES module, its network, TypeScript types and an example page."""
    input:
        weights=network_file("weights.npz"),
        bundle=rules.page_bundle.output.js,
        scripts=rules.page_bundle.input.scripts,
        engine=rules.page_bundle.input.engine,
        wasm=rules.engine_wasm.output.wasm,
        files=keep_local(
            [*package.files("report/web/*.ts"), *package.files("report/web/*.html")]
        ),
    output:
        folder=directory("results/{configuration}/export/web"),
    log:
        "results/{configuration}/logs/report/export_web.log",
    benchmark:
        "results/{configuration}/benchmarks/report/export_web.tsv"
    resources:
        mem_mb=1500,
        runtime=10,
    params:
        runtime=section("runtime"),
        code=network_code("export_web"),
    script:
        "../scripts/export_web.py"


rule limp_picture:
    """A looping animation of the healthy and the hurt walk side by side, for the README."""
    input:
        weights=network_file("weights.npz"),
    output:
        picture=report(
            "results/{configuration}/limp.webp",
            caption="../report/limp.rst",
            category="Characters",
            labels={"configuration": "{configuration}"},
        ),
    log:
        "results/{configuration}/logs/report/limp_picture.log",
    benchmark:
        "results/{configuration}/benchmarks/report/limp_picture.tsv"
    resources:
        mem_mb=1500,
        runtime=10,
    params:
        runtime=section("runtime"),
        code=network_code("limp_picture"),
    script:
        "../scripts/limp_picture.py"
