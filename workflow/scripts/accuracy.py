"""Creates accuracy.json and accuracy.csv from a network's weights and the rows of every clip."""

from pathlib import Path

from hobble.core.files import write_json, write_text
from hobble.core.untrusted import read_yaml
from hobble.evaluation.accuracy import equivalent_joints, measure, to_csv
from hobble.workflow.job import job

with job(snakemake):
    equivalents = None
    if snakemake.params.joints == "equivalent":
        skeleton = snakemake.input.skeleton
        equivalents = equivalent_joints(read_yaml(skeleton))
    result = measure(
        snakemake.input.weights,
        {Path(file).stem: file for file in snakemake.input.clips},
        snakemake.params.splits,
        snakemake.params.configuration,
        equivalents,
    )
    write_json(snakemake.output.json, result)
    write_text(snakemake.output.csv, to_csv(result))
