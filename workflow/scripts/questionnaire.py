"""Creates results/<configuration>/questionnaire/: the page that asks what hurts, and the right answers."""

from pathlib import Path

from hobble.measures.films import list_doubts, write_questionnaire
from hobble.models.load import load_network
from hobble.runtime.options import Runtime
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
    for doubt in list_doubts(solution):
        log.warning("%s", doubt)
    log.info("wrote %d films to %s", len(solution["films"]), folder)
