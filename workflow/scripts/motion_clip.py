"""Creates a checked clip on the data set's skeleton at 60 Hz, and its report, from a BVH file."""

from hobble.core.clip import save_clip
from hobble.core.files import write_json
from hobble.motion.make import make_clip
from hobble.motion.options import ClipMotion
from hobble.workflow.job import job

with job(snakemake) as log:
    clip, report = make_clip(
        snakemake.input.bvh,
        snakemake.input.skeleton,
        snakemake.params.maps,
        clip=snakemake.params.clip,
        skeleton_name=snakemake.params.skeleton_name,
        options=ClipMotion.model_validate(snakemake.params.options),
    )
    for sentence in report["repairs"]:
        log.info("%s", sentence)
    for sentence in report["unsure"]:
        log.warning("%s: %s", snakemake.params.clip, sentence)
    save_clip(snakemake.output.clip, clip)
    write_json(snakemake.output.report, report)
