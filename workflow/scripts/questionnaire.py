"""Creates results/<configuration>/questionnaire/: the page that asks what hurts, and the right answers."""

from pathlib import Path

from hobble.measures.films import write_questionnaire
from hobble.models.load import load_network
from hobble.report.stimuli import film_warnings
from hobble.runtime import Runtime
from hobble.workflow.job import job

with job(snakemake) as log:
    folder = Path(snakemake.output.page).parent
    solution = write_questionnaire(
        load_network(snakemake.input.weights),
        folder,
        Runtime.model_validate(snakemake.params.runtime),
        snakemake.params.configuration,
        parts=snakemake.params.parts,
        threads=snakemake.threads,
    )
    films = [(f"film {row['film']}", row["from_healthy_cm"], row["untrained"]) for row in solution["films"]]
    for warning in film_warnings(films):
        log.warning("%s", warning)
    log.info("wrote %d films to %s", len(solution["films"]), folder)
