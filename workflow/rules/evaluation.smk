rule accuracy:
    """One-step accuracy of every clip, training and held-out."""
    input:
        weights=lambda w: project.network(w.configuration, "weights.npz"),
        clips=lambda w: project.of_dataset(w.configuration, "database/clips/{clip}.npz"),
        skeleton=lambda w: project.skeleton_file(
            project.configuration(w.configuration).dataset
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
        mem_mb=2000,
        runtime=60,
    params:
        configuration=lambda w: w.configuration,
        splits=lambda w: project.splits(w.configuration),
        joints=lambda w: project.configuration(w.configuration).evaluation.joints,
        code=project.code("accuracy"),
    script:
        "../scripts/accuracy.py"


rule responsivity:
    """Laps of the waypoint track: milliseconds a frame of each step, and how well it is followed."""
    input:
        weights=lambda w: project.network(w.configuration, "weights.npz"),
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
        runtime=lambda w: project.section(w.configuration, "runtime"),
        evaluation=lambda w: project.section(w.configuration, "evaluation"),
        code=project.code("responsivity"),
    script:
        "../scripts/responsivity.py"


rule injury_response:
    """How the gait changes as the severity of each link is swept from 0 to 10."""
    input:
        weights=lambda w: project.network(w.configuration, "weights.npz"),
    output:
        json="results/{configuration}/evaluation/injury.json",
        csv="results/{configuration}/evaluation/injury.csv",
    log:
        "results/{configuration}/logs/evaluation/injury_response.log",
    benchmark:
        "results/{configuration}/benchmarks/evaluation/injury_response.tsv"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=60,
    params:
        configuration=lambda w: w.configuration,
        runtime=lambda w: project.section(w.configuration, "runtime"),
        evaluation=lambda w: project.section(w.configuration, "evaluation"),
        code=project.code("injury_response"),
    script:
        "../scripts/injury_response.py"
