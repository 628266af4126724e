"""Creates hurt versions of healthy clips, and their mirrors: motion, labels, severities and reports."""

from hobble.channels import channel
from hobble.channels.channel import load_values, save_values
from hobble.channels.channel import write_report as write_channel_report
from hobble.core.clip import load_clip, load_clip_report, save_clip
from hobble.core.declared import load_report
from hobble.core.files import write_json
from hobble.hurt import HURT_CHANNEL, Hurt
from hobble.hurt.version import hurt_version
from hobble.labels.clip_labels import LabelReport, load_labels, save_labels
from hobble.labels.label import mirror_labels, write_report
from hobble.motion.edit import mirror_clip, mirror_report
from hobble.workflow.job import make_each

# Name -> each file of a hurt version, and of its mirror.
FILES = {
    "clip": "motion/{clip}.npz",
    "report": "motion/{clip}.json",
    "labels": "labels/{clip}.npz",
    "label_report": "labels/{clip}.json",
    "injury": f"channels/{HURT_CHANNEL}/{{clip}}.npz",
    "injury_report": f"channels/{HURT_CHANNEL}/{{clip}}.json",
}


def make_version(piece, log):
    """Write a hurt version and its mirror.

    piece: the hurt version with its params and files, a `Piece`.
    """
    clip = load_clip(piece.input["clip"])
    hurt, label_report, guarding = hurt_version(
        clip,
        load_labels(piece.input["labels"]),
        load_report(piece.input["label_report"], "the report of labels", LabelReport),
        Hurt.model_validate(piece.params["options"]),
        name=piece.name,
        version_number=piece.params["turn"],
        ground=piece.params["ground"],
    )
    motion_report = {
        **load_clip_report(piece.input["report"]),
        "clip": hurt.clip.name,
        "hurt_of": clip.name,
        "guarding": guarding,
    }
    write_files(piece.output, "", hurt.clip, motion_report, hurt.labels, label_report, hurt.severity)
    log.info("%s: %d frames from %d of %s", hurt.clip.name, len(hurt.clip), len(clip), clip.name)
    if "mirror_clip" in piece.output:
        make_mirror(piece.output)


def make_mirror(output):
    """Write the mirror of a hurt version, whose own files are written.

    output: name of each output -> its file.
    """
    clip = load_clip(output["clip"])
    clip = mirror_clip(clip, f"{clip.name}_mirror")
    motion_report = mirror_report(load_clip_report(output["report"]), clip.name)
    label_report = load_report(output["label_report"], "the report of labels", LabelReport)
    labels, label_report = mirror_labels(load_labels(output["labels"]), label_report, clip)
    severity = channel(HURT_CHANNEL).mirror(load_values(output["injury"])[0], clip.skeleton)
    write_files(output, "mirror_", clip, motion_report, labels, label_report, severity)


def write_files(output, prefix, clip, motion_report, labels, label_report, severity):
    """Write all files of a hurt version, or of its mirror.

    output: name of each output -> its file. prefix: of the names of these outputs: "" or "mirror_".
    """
    save_clip(output[f"{prefix}clip"], clip)
    write_json(output[f"{prefix}report"], motion_report)
    save_labels(output[f"{prefix}labels"], labels)
    write_report(output[f"{prefix}label_report"], label_report, labels, clip)
    save_values(output[f"{prefix}injury"], severity, clip.skeleton.link_names)
    write_channel_report(output[f"{prefix}injury_report"], HURT_CHANNEL, clip.name, [])


make_each(
    snakemake,
    make_version,
    reads={
        "clip": "motion/{original}.npz",
        "report": "motion/{original}.json",
        "labels": "labels/{original}.npz",
        "label_report": "labels/{original}.json",
    },
    writes={
        prefix + name: file.replace("{clip}", clip)
        for prefix, clip in (("", "{clip}"), ("mirror_", "{mirror}"))
        for name, file in FILES.items()
    },
)
