"""Creates results/<configuration>/pipeline.json: the time, memory and disk space that each stage took."""

from pathlib import Path

from hobble.core.files import write_json
from hobble.report.provenance import summarise_pipeline
from hobble.workflow.job import job

with job(snakemake):
    params = snakemake.params
    # In a workflow that imports this one with a prefix, results/ is in the prefix's folder.
    root = Path(snakemake.output.json).parents[2]
    stages = {
        stage: {
            name: paths if name == "batches" else [str(root / path) for path in paths]
            for name, paths in costs.items()
        }
        for stage, costs in params.stages.items()
    }
    write_json(snakemake.output.json, summarise_pipeline(params.configuration, stages))
