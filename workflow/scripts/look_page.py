"""Creates results/datasets/<dataset>/look.html: a page with one line for each clip of a data set."""

from hobble.core.clip import load_clip
from hobble.core.files import read_json, write_text
from hobble.labels.clip_labels import load_labels
from hobble.motion.look import LABELS, look_page
from hobble.workflow.job import Inputs, job

with job(snakemake):
    files, clips = Inputs(snakemake.input.batches), snakemake.params.clips

    def read_clip(n):
        """Clip n and its contacts. The page calls this only for the clips that it draws."""
        name = f"{clips[n]}.npz"
        return load_clip(files(f"motion/{name}")), load_labels(files(f"labels/{name}")).contacts

    reports = [read_json(files(f"labels/{clip}.json")) for clip in clips]
    page = look_page(
        snakemake.params.dataset,
        [read_json(files(f"motion/{clip}.json")) for clip in clips],
        [{key: labels[key] for key in LABELS} for labels in reports],
        read_clip,
    )
    write_text(snakemake.output.html, page)
