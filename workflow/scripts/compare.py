"""Creates compare.json and its CSV tables from the results of the compared configurations."""

from pathlib import Path

import yaml

from hobble.core.files import write_json, write_tables
from hobble.measures.compare import compare_configurations, comparison_tables, read_results
from hobble.workflow.job import job

with job(snakemake):
    files = snakemake.input
    results = [
        # Its measurements are the files results/<name>/evaluation/<measure>.json.
        read_results(name, *paths, [f for f in files.measurements if Path(f).parts[-3] == name])
        for name, *paths in zip(
            snakemake.params.configurations, files.configuration, files.pipeline, files.history, strict=True
        )
    ]
    published = yaml.safe_load(Path(files.published).read_text(encoding="utf-8"))
    comparison = compare_configurations(results, published)
    write_json(snakemake.output.json, comparison)
    write_tables(snakemake.output.tables, comparison_tables(comparison))
