"""Creates clips, their mirrors and their reports from BVH files.

The clips are checked, retargeted to the data set's skeleton and resampled at 60 Hz.
"""

from hobble.core.clip import load_clip, save_clip
from hobble.core.files import write_json
from hobble.core.messages import group_messages, in_words
from hobble.motion import ClipMotion
from hobble.motion.edit import mirror_clip, mirror_report
from hobble.motion.make import make_clip
from hobble.workflow.job import make_each

doubts = []  # (clip, stage, sentence) of all clips of this job


def make_motion(piece, log):
    """Write a clip and its mirror.

    piece: the clip with its params and files, a `Piece`.
    """
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
        log.info("%s", sentence)
        doubts.append((piece.name, "doubt", sentence))
    save_clip(piece.output["clip"], clip)
    write_json(piece.output["report"], report)
    if "mirror" in piece.output:
        mirror = mirror_clip(load_clip(piece.output["clip"]), f"{piece.name}_mirror")
        save_clip(piece.output["mirror"], mirror)
        write_json(piece.output["mirror_report"], mirror_report(report, mirror.name))


def warn_of_doubts(log):
    """One warning for each kind of doubt, not one for each clip."""
    for group in group_messages(doubts):
        log.warning("%s", in_words(group))


make_each(
    snakemake,
    make_motion,
    after=warn_of_doubts,
    writes={
        "clip": "motion/{clip}.npz",
        "report": "motion/{clip}.json",
        "mirror": "motion/{mirror}.npz",
        "mirror_report": "motion/{mirror}.json",
    },
)
