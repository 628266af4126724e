"""Downloads a clip that is not in the user's folder. A file with a wrong checksum is refused."""

from hobble.motion.download import download_clip
from hobble.workflow.job import job

with job(snakemake) as log:
    size = download_clip(
        snakemake.params.url,
        snakemake.output.bvh,
        snakemake.params.sha256,
        snakemake.params.folder,
    )
    log.info("%s: %d bytes", snakemake.params.url, size)
