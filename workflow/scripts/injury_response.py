"""Creates the injury response measurements (JSON, CSV) from a trained network and the captured clips."""

from hobble.core.files import write_json
from hobble.evaluation.captured import captured_clips
from hobble.evaluation.injury import injury_response
from hobble.evaluation.tables import write_csv
from hobble.models.load import load_network
from hobble.workflow.job import job

with job(snakemake) as log:
    result = injury_response(
        load_network(snakemake.input.weights),
        captured_clips(snakemake.input.clips),
        configuration=snakemake.params.configuration,
        runtime=snakemake.params.runtime,
        seconds=snakemake.params.evaluation["seconds"],
    )
    write_json(snakemake.output.json, result)
    write_csv(snakemake.output.csv, [*result.get("rows", []), *result.get("back", [])])
    for name in ("second", "into_a_jog", "divided"):
        write_csv(snakemake.output[name], result.get(name, []))
    log.info("%s", result.get("summary", result.get("reason")))
