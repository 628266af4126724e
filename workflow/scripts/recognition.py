"""Creates recognition.json and its confusion tables (CSV): a classifier of the clips looks at our walks."""

from pathlib import Path

import yaml

from hobble.core.files import write_json
from hobble.evaluation.captured import captured_clips
from hobble.evaluation.recognition import recognition, rows
from hobble.evaluation.tables import write_csv
from hobble.models.load import load_network
from hobble.workflow.job import job

with job(snakemake) as log:
    published = yaml.safe_load(Path(snakemake.input.published).read_text(encoding="utf-8"))
    result = recognition(
        load_network(snakemake.input.weights),
        captured_clips(snakemake.input.clips),
        snakemake.params.splits,
        configuration=snakemake.params.configuration,
        runtime=snakemake.params.runtime,
        people=published["recognition"]["share"],
    )
    write_json(snakemake.output.json, result)
    write_csv(snakemake.output.csv, rows(result))
    if result["applies"]:
        log.info("named right: %s of generated windows", result["generated"]["right"])
    else:
        log.info("%s", result["reason"])
