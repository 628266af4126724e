"""Creates results/<configuration>/export/hobble_blender.zip: the add-on for Blender with the character."""

from pathlib import Path

from hobble.engine.export import write_blender_addon
from hobble.workflow.job import job

with job(snakemake) as log:
    given = snakemake.input
    character = Path(given.engine) / "character.hob"
    write_blender_addon(
        snakemake.output.addon, Path(given.addon[0]).parent, given.libraries, character, given.body
    )
    log.info("wrote %s", snakemake.output.addon)
