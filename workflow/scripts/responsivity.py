"""Creates the responsivity measurements (JSON, CSV) from a trained network."""

from hobble.core.files import write_json
from hobble.evaluation.responsivity import lap_rows, responsivity
from hobble.evaluation.tables import write_csv
from hobble.models.load import load_network
from hobble.workflow.job import job

with job(snakemake) as log:
    result = responsivity(
        load_network(snakemake.input.weights),
        configuration=snakemake.params.configuration,
        runtime=snakemake.params.runtime,
        laps=snakemake.params.evaluation["laps"],
        lap_seconds=snakemake.params.evaluation["lap_seconds"],
        modes=snakemake.params.evaluation["modes"],
    )
    write_json(snakemake.output.json, result)
    write_csv(snakemake.output.csv, lap_rows(result))
    for mode in result["modes"]:
        log.info("%s: %d of %d waypoints reached", mode["mode"], mode["waypoints_reached"], mode["waypoints"])
