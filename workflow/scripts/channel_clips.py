"""Creates the values of channels in each frame of clips and their mirrors from the data set's sources."""

from hobble.channels import channel
from hobble.channels.clip_values import read_clip_values, save_values, write_report
from hobble.core.clip import load_clip
from hobble.core.files import read_json
from hobble.workflow.batch_job import make_each


def make(piece, log):
    """Read the values of one channel for a clip and its mirror."""
    name, clip = piece.params["channel"], load_clip(piece.input["clip"])
    source = channel(name).make_source(piece.params["source"], piece.input.get("files", []))
    values, warnings = read_clip_values(name, clip, source, read_json(piece.input["report"]))
    for warning in warnings:
        log.warning("%s", warning)
    labels = channel(name).columns(clip.skeleton)
    save_values(piece.output["values"], values, labels)
    write_report(piece.output["report"], name, clip, values, labels, warnings)
    if "mirror" in piece.output:
        clip = load_clip(piece.input["mirror"])
        values = channel(name).mirror(values, clip.skeleton)
        save_values(piece.output["mirror"], values, labels)
        write_report(piece.output["mirror_report"], name, clip, values, labels, warnings)


make_each(snakemake, make)
