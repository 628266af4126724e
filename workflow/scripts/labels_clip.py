"""Creates contacts, phase and gait of a clip from its motion and the hand-made files beside its source."""

from hobble.core.clip import load_clip
from hobble.core.files import read_json
from hobble.labels.label import label_clip, write_report
from hobble.labels.model import save_labels
from hobble.labels.options import Labels
from hobble.workflow.job import job

with job(snakemake) as log:
    clip = load_clip(snakemake.input.clip)
    labels, report = label_clip(
        clip,
        snakemake.input.get("files", []),
        read_json(snakemake.input.report),
        snakemake.params.gait,
        snakemake.params.ground,
        Labels.model_validate(snakemake.params.options),
    )
    for warning in report.warnings:
        log.info("%s: %s", report.clip, warning)
    save_labels(snakemake.output.labels, labels)
    write_report(snakemake.output.report, report, labels, clip)
