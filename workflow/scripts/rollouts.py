"""Creates rollouts.json and rollouts.csv from a network's weights and the rows of every clip."""

from pathlib import Path

import yaml

from hobble.core.files import write_json
from hobble.evaluation.accuracy import equivalent_joints
from hobble.evaluation.rollouts import measure_roll_outs, roll_out_rows
from hobble.evaluation.tables import write_csv
from hobble.workflow.job import job

with job(snakemake):
    equivalents = None
    if snakemake.params.evaluation["joints"] == "equivalent":
        skeleton = snakemake.input.skeleton
        equivalents = equivalent_joints(yaml.safe_load(Path(skeleton).read_text(encoding="utf-8")))
    result = measure_roll_outs(
        snakemake.input.weights,
        {Path(file).stem: file for file in snakemake.input.clips},
        snakemake.params.splits,
        snakemake.params.configuration,
        equivalents,
        snakemake.params.evaluation["rollouts"],
        snakemake.params.mode,
    )
    write_json(snakemake.output.json, result)
    write_csv(snakemake.output.csv, roll_out_rows(result))
