"""Creates the labels of clips and of their mirrors: contacts, phase and gait.

They are computed from the motion, or taken from hand-made label files.
"""

from hobble.core.clip import load_clip, load_clip_report
from hobble.core.declared import load_report
from hobble.labels import LabelOptions
from hobble.labels.clip_labels import LabelReport, load_labels, save_labels
from hobble.labels.label import label_clip, mirror_labels, write_report
from hobble.workflow.job import make_each


def make_labels(piece, log):
    """Write the labels of a clip and of its mirror.

    piece: the clip with its params and files, a `Piece`.
    """
    clip = load_clip(piece.input["clip"])
    labels, report = label_clip(
        clip,
        piece.input["files"],
        load_clip_report(piece.input["report"]),
        piece.params["gait"],
        piece.params["ground"],
        LabelOptions.model_validate(piece.params["options"]),
    )
    for warning in report.warnings:
        log.info("%s: %s", report.clip, warning)
    save_labels(piece.output["labels"], labels)
    write_report(piece.output["report"], report, labels, clip)
    if "mirror" in piece.output:
        mirror = load_clip(piece.input["mirror"])
        report = load_report(piece.output["report"], "the report of labels", LabelReport)
        labels, report = mirror_labels(load_labels(piece.output["labels"]), report, mirror)
        save_labels(piece.output["mirror"], labels)
        write_report(piece.output["mirror_report"], report, labels, mirror)


make_each(
    snakemake,
    make_labels,
    reads={"clip": "motion/{clip}.npz", "report": "motion/{clip}.json", "mirror": "motion/{mirror}.npz"},
    writes={
        "labels": "labels/{clip}.npz",
        "report": "labels/{clip}.json",
        "mirror": "labels/{mirror}.npz",
        "mirror_report": "labels/{mirror}.json",
    },
)
