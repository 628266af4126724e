"""Creates the values of channels in each frame of clips and of their mirrors.

A channel is a set of network inputs besides motion and ground. Its values come from files or
from the data set.
"""

from hobble.channels import channel
from hobble.channels.channel import save_values, write_report
from hobble.core.clip import load_clip, load_clip_report
from hobble.workflow.job import make_each


def make_values(piece, log):
    """Write the values of one channel for a clip and its mirror.

    piece: the channel and the clip with their params and files, a `Piece`.
    """
    name, clip = piece.params["channel"], load_clip(piece.input["clip"])
    source = channel(name).make_source(piece.params["source"], piece.input["files"])
    values, warnings = channel(name).read_checked(clip, source, load_clip_report(piece.input["report"]))
    for warning in warnings:
        log.warning("%s", warning)
    columns = channel(name).columns(clip.skeleton)
    save_values(piece.output["values"], values, columns)
    write_report(piece.output["report"], name, clip.name, warnings)
    if "mirror" in piece.output:
        mirror = load_clip(piece.input["mirror"])
        values = channel(name).mirror(values, mirror.skeleton)
        save_values(piece.output["mirror"], values, columns)
        write_report(piece.output["mirror_report"], name, mirror.name, warnings)


make_each(
    snakemake,
    make_values,
    reads={"clip": "motion/{clip}.npz", "report": "motion/{clip}.json", "mirror": "motion/{mirror}.npz"},
    writes={
        "values": "channels/{channel}/{clip}.npz",
        "report": "channels/{channel}/{clip}.json",
        "mirror": "channels/{channel}/{mirror}.npz",
        "mirror_report": "channels/{channel}/{mirror}.json",
    },
)
