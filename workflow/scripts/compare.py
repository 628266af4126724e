"""Creates compare.json and its CSV tables from the results of the compared configurations."""

from pathlib import Path

import yaml

from hobble.core.files import write_json
from hobble.evaluation.compare_configurations import compare_configurations
from hobble.evaluation.comparison_csv import comparison_tables
from hobble.evaluation.configuration_results import read_results
from hobble.evaluation.csv_tables import write_tables
from hobble.workflow.job import job

with job(snakemake):
    files = snakemake.input
    results = [
        read_results(name, {key: files[key][i] for key in snakemake.params.files})
        for i, name in enumerate(snakemake.params.configurations)
    ]
    published = yaml.safe_load(Path(files.published).read_text(encoding="utf-8"))
    comparison = compare_configurations(results, published)
    write_json(snakemake.output.json, comparison)
    write_tables(snakemake.output.tables, comparison_tables(comparison))
