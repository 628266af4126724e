rule accuracy:
    """One-step accuracy of every clip, training and held-out."""
    input:
        weights=lambda w: configurations.network(w.configuration, "weights.npz"),
        clips=lambda w: configurations.of_dataset(
            w.configuration, "database/clips/{clip}.npz"
        ),
        skeleton=lambda w: kept(
            clips.skeleton_file(configurations.dataset(w.configuration))
        ),
    output:
        json="results/{configuration}/evaluation/accuracy.json",
        csv="results/{configuration}/evaluation/accuracy.csv",
    log:
        "results/{configuration}/logs/evaluation/accuracy.log",
    benchmark:
        "results/{configuration}/benchmarks/evaluation/accuracy.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.evaluation_memory(
            w.configuration, 12, attempt
        ),
        runtime=lambda w, attempt: demands.evaluation_minutes(
            w.configuration, 0.2, attempt, least=10
        ),
    params:
        configuration=lambda w: w.configuration,
        splits=lambda w: configurations.splits(w.configuration),
        joints=lambda w: catalogue.configuration(w.configuration).evaluation.joints,
        code=package.code("accuracy"),
    script:
        "../scripts/accuracy.py"


rule rollouts:
    """How far the figure strays from every clip when it is fed its own pose."""
    input:
        weights=lambda w: configurations.network(w.configuration, "weights.npz"),
        clips=lambda w: configurations.of_dataset(
            w.configuration, "database/clips/{clip}.npz"
        ),
        skeleton=lambda w: kept(
            clips.skeleton_file(configurations.dataset(w.configuration))
        ),
    output:
        json="results/{configuration}/evaluation/rollouts.json",
        csv="results/{configuration}/evaluation/rollouts.csv",
    log:
        "results/{configuration}/logs/evaluation/rollouts.log",
    benchmark:
        "results/{configuration}/benchmarks/evaluation/rollouts.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.evaluation_memory(
            w.configuration, 27, attempt
        ),
        runtime=lambda w, attempt: demands.evaluation_minutes(
            w.configuration, 0.6, attempt, least=30
        ),
    params:
        configuration=lambda w: w.configuration,
        splits=lambda w: configurations.splits(w.configuration),
        evaluation=lambda w: configurations.section(
            w.configuration, "evaluation", "joints", "rollouts"
        ),
        mode=lambda w: configurations.section(w.configuration, "runtime")["mode"],
        code=package.code("rollouts"),
    script:
        "../scripts/rollouts.py"


rule responsivity:
    """Laps of the waypoint track in each phase mode: milliseconds a frame, and how well it is followed."""
    input:
        weights=lambda w: configurations.network(w.configuration, "weights.npz"),
    output:
        json="results/{configuration}/evaluation/responsivity.json",
        csv="results/{configuration}/evaluation/responsivity.csv",
    log:
        "results/{configuration}/logs/evaluation/responsivity.log",
    benchmark:
        "results/{configuration}/benchmarks/evaluation/responsivity.tsv"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=60,
    params:
        configuration=lambda w: w.configuration,
        runtime=lambda w: configurations.section(w.configuration, "runtime"),
        evaluation=lambda w: configurations.section(
            w.configuration, "evaluation", "laps", "lap_seconds", "modes"
        ),
        code=package.code("responsivity"),
    script:
        "../scripts/responsivity.py"


rule injury_response:
    """How the gait changes as the severity of each link is swept from 0 to 10 and back."""
    input:
        weights=lambda w: configurations.network(w.configuration, "weights.npz"),
        clips=lambda w: configurations.of_dataset(
            w.configuration, "database/clips/{clip}.npz"
        ),
    output:
        json="results/{configuration}/evaluation/injury.json",
        csv="results/{configuration}/evaluation/injury.csv",
        second="results/{configuration}/evaluation/injury_second.csv",
        into_a_jog="results/{configuration}/evaluation/injury_into_a_jog.csv",
        divided="results/{configuration}/evaluation/injury_divided.csv",
    log:
        "results/{configuration}/logs/evaluation/injury_response.log",
    benchmark:
        "results/{configuration}/benchmarks/evaluation/injury_response.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.evaluation_memory(
            w.configuration, 14, attempt
        ),
        runtime=lambda w, attempt: demands.evaluation_minutes(
            w.configuration, 0.2, attempt, least=60
        ),
    params:
        configuration=lambda w: w.configuration,
        runtime=lambda w: configurations.section(w.configuration, "runtime"),
        evaluation=lambda w: configurations.section(
            w.configuration, "evaluation", "seconds"
        ),
        code=package.code("injury_response"),
    script:
        "../scripts/injury_response.py"


rule recognition:
    """Whether it can be told what hurts: a classifier of the captured clips names generated walks."""
    input:
        weights=lambda w: configurations.network(w.configuration, "weights.npz"),
        clips=lambda w: configurations.of_dataset(
            w.configuration, "database/clips/{clip}.npz"
        ),
        published=kept(package.published()),
    output:
        json="results/{configuration}/evaluation/recognition.json",
        csv="results/{configuration}/evaluation/recognition.csv",
    log:
        "results/{configuration}/logs/evaluation/recognition.log",
    benchmark:
        "results/{configuration}/benchmarks/evaluation/recognition.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.evaluation_memory(
            w.configuration, 18, attempt
        ),
        runtime=lambda w, attempt: demands.evaluation_minutes(
            w.configuration, 0.2, attempt, least=30
        ),
    params:
        configuration=lambda w: w.configuration,
        splits=lambda w: configurations.splits(w.configuration),
        runtime=lambda w: configurations.section(w.configuration, "runtime"),
        code=package.code("recognition"),
    script:
        "../scripts/recognition.py"


rule compare:
    """Configurations side by side, with the published figures: one JSON and its tables as CSV."""
    input:
        configuration=lambda w: comparison.measured()["configuration"],
        accuracy=lambda w: comparison.measured()["accuracy"],
        rollouts=lambda w: comparison.measured()["rollouts"],
        responsivity=lambda w: comparison.measured()["responsivity"],
        injury=lambda w: comparison.measured()["injury"],
        recognition=lambda w: comparison.measured()["recognition"],
        pipeline=lambda w: comparison.measured()["pipeline"],
        history=lambda w: comparison.measured()["history"],
        published=kept(package.published()),
    output:
        json="results/compare/compare.json",
        configurations="results/compare/configurations.csv",
        accuracy="results/compare/accuracy.csv",
        rollouts="results/compare/rollouts.csv",
        recognition="results/compare/recognition.csv",
        responsivity="results/compare/responsivity.csv",
        training="results/compare/training.csv",
        stages="results/compare/stages.csv",
        difference="results/compare/difference.csv",
        fit="results/compare/fit.csv",
        published="results/compare/published.csv",
    log:
        "results/compare/logs/evaluation/compare.log",
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        configurations=lambda w: comparison.names(),
        files=lambda w: sorted(comparison.measured()),
        code=package.code("compare"),
    script:
        "../scripts/compare.py"
