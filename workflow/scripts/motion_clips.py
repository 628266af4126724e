"""Creates checked clips on the data set's skeleton at 60 Hz, their mirrors and reports, from BVH files."""

from hobble.core.clip import load_clip, save_clip
from hobble.core.files import write_json
from hobble.motion.make import make_clip
from hobble.motion.mirror import mirror_clip, mirror_report
from hobble.motion.options import ClipMotion
from hobble.workflow.batch_job import make_each


def make(piece, log):
    """Make a clip and its mirror."""
    clip, report = make_clip(
        piece.input["bvh"],
        piece.input["skeleton"],
        piece.params["maps"],
        clip=piece.name,
        skeleton_name=piece.params["skeleton_name"],
        options=ClipMotion.model_validate(piece.params["options"]),
    )
    for sentence in report["repairs"]:
        log.info("%s", sentence)
    for sentence in report["unsure"]:
        log.warning("%s: %s", piece.name, sentence)
    save_clip(piece.output["clip"], clip)
    write_json(piece.output["report"], report)
    if "mirror" in piece.output:
        mirror = mirror_clip(load_clip(piece.output["clip"]), f"{piece.name}_mirror")
        save_clip(piece.output["mirror"], mirror)
        write_json(piece.output["mirror_report"], mirror_report(report, mirror.name))


make_each(snakemake, make)
