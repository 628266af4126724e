"""Creates the rows of one clip from its motion, labels, channel values and terrain fits."""

from hobble.channels.files import load_values
from hobble.core.clip import load_clip
from hobble.core.files import load_npz
from hobble.database.options import Rows
from hobble.rows.build import clip_rows
from hobble.rows.clip_rows import save_clip_rows
from hobble.rows.facts import facts, save_facts
from hobble.workflow.job import job

with job(snakemake) as log:
    options = Rows.model_validate(snakemake.params.options)
    rows = clip_rows(
        snakemake.params.clip,
        load_clip(snakemake.input.clip),
        load_npz(snakemake.input.labels),
        {
            name: load_values(file)[0]
            for name, file in zip(snakemake.params.channels, snakemake.input.get("channels", []), strict=True)
        },
        load_npz(snakemake.input.terrain),
        window=options.window,
        step=options.step,
        facing_sigma=options.facing_sigma,
    )
    save_clip_rows(snakemake.output.rows, rows)
    save_facts(snakemake.output.facts, facts(rows))
    log.info("%d rows, %d fits", len(rows), rows.fits.sum())
