"""Creates results/datasets/<dataset>/look.html: a page with one line for each clip of a data set."""

from hobble.core.clip import load_clip
from hobble.core.files import read_json, write_text
from hobble.labels.model import load_labels
from hobble.motion.look_page import foot_down, look_page
from hobble.workflow.job import job

with job(snakemake):
    given = snakemake.input
    page = look_page(
        snakemake.params.dataset,
        [load_clip(file) for file in given.clips],
        [read_json(file) for file in given.reports],
        [read_json(file) for file in given.labels],
        [foot_down(load_labels(file).contacts) for file in given.contacts],
    )
    write_text(snakemake.output.html, page)
