"""Creates results/datasets/<dataset>/look.html: a page with one line for each clip of a data set."""

from hobble.core.clip import load_clip
from hobble.core.files import read_json, write_text
from hobble.labels.clip_labels import load_labels
from hobble.motion.look_page import LABELS, look_page
from hobble.workflow.job import job

with job(snakemake):
    given = snakemake.input
    page = look_page(
        snakemake.params.dataset,
        [read_json(file) for file in given.reports],
        [{key: labels[key] for key in LABELS} for labels in map(read_json, given.labels)],
        lambda n: (load_clip(given.clips[n]), load_labels(given.contacts[n]).contacts),
    )
    write_text(snakemake.output.html, page)
