"""Creates results/datasets/<dataset>/look.html: a page with one line for each clip of a data set."""

from hobble.core.clip import load_clip
from hobble.core.files import read_json, write_text
from hobble.labels.clip_labels import load_labels
from hobble.motion.look import LABELS, look_page
from hobble.workflow.job import job

with job(snakemake):
    files = snakemake.input

    def read_clip(n):
        """Clip n and its contacts. The page calls this only for the clips that it draws."""
        return load_clip(files.clips[n]), load_labels(files.contacts[n]).contacts

    page = look_page(
        snakemake.params.dataset,
        [read_json(file) for file in files.reports],
        [{key: labels[key] for key in LABELS} for labels in map(read_json, files.labels)],
        read_clip,
    )
    write_text(snakemake.output.html, page)
