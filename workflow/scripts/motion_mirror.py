"""Creates the mirrored clip and its report from a clip."""

from hobble.core.clip import load_clip, save_clip
from hobble.core.files import read_json, write_json
from hobble.motion.mirror import mirror_clip, mirror_report
from hobble.workflow.job import job

with job(snakemake):
    clip = mirror_clip(load_clip(snakemake.input.clip), snakemake.params.clip)
    save_clip(snakemake.output.clip, clip)
    write_json(snakemake.output.report, mirror_report(read_json(snakemake.input.report), clip.name))
