"""Creates the labels of a mirrored clip from those of its original."""

from hobble.core.clip import load_clip
from hobble.core.files import read_json
from hobble.labels.label import mirror_labels, write_report
from hobble.labels.model import LabelReport, load_labels, save_labels
from hobble.workflow.job import job

with job(snakemake):
    clip = load_clip(snakemake.input.clip)
    original = load_labels(snakemake.input.labels)
    labels, report = mirror_labels(original, LabelReport.from_dict(read_json(snakemake.input.report)), clip)
    save_labels(snakemake.output.labels, labels)
    write_report(snakemake.output.report, report, labels, clip)
