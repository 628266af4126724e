"""Creates the rows of clips from their motion, labels, channel values and the ground fitted under them.

A row holds the network's input X, output Y and phase P for one frame.
"""

from hobble.channels.channel import load_values
from hobble.core.clip import load_clip
from hobble.database import RowOptions
from hobble.labels.clip_labels import load_labels
from hobble.labels.local_phase import local_phases
from hobble.rows.build_rows import build_clip_rows
from hobble.rows.clip_rows import save_clip_rows, save_summary, summary_of_rows
from hobble.terrain.clip_fits import load_fits
from hobble.workflow.job import make_each


def phases_of(clip, labels, source, autoencoder):
    """The local phases of a clip from their source, the option `local_phases`.

    autoencoder: path of the autoencoder's file, in a list.
    """
    if source == "autoencoder":
        from hobble.labels.autoencoder import load_autoencoder  # imports PyTorch

        return load_autoencoder(autoencoder[0], clip.skeleton).local_phases(clip)
    return local_phases(clip, labels.contacts)


def make_rows(piece, log):
    """Write the rows of a clip and a summary of them.

    piece: the clip or mirror with its params and files, a `Piece`.
    """
    options = RowOptions.model_validate(piece.params["options"])
    files_of_channels = zip(piece.params["channels"], piece.input["channels"], strict=True)
    clip, labels = load_clip(piece.input["clip"]), load_labels(piece.input["labels"])
    rows = build_clip_rows(
        piece.name,
        clip,
        vars(labels),
        {name: load_values(file)[0] for name, file in files_of_channels},
        load_fits(piece.input["terrain"]),
        window=options.window,
        step=options.step,
        facing_sigma=options.facing_sigma,
        local_phases=phases_of(clip, labels, options.local_phases, piece.input["autoencoder"]),
    )
    save_clip_rows(piece.output["rows"], rows)
    save_summary(piece.output["summaries"], summary_of_rows(rows))
    log.info("%d rows, %d fits", len(rows), rows.fits.sum())


make_each(
    snakemake,
    make_rows,
    reads={
        "clip": "motion/{clip}.npz",
        "labels": "labels/{clip}.npz",
        "channels": "channels/{channels}/{clip}.npz",
        "terrain": "terrain/clips/{clip}.npz",
    },
    writes={"rows": "database/clips/{clip}.npz", "summaries": "database/clips/{clip}.json"},
)
