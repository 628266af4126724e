"""Creates a hurt version of a healthy clip: its motion, labels and severities, and their reports."""

from hobble.channels.files import save_values
from hobble.channels.files import write_report as write_channel_report
from hobble.core.clip import load_clip, save_clip
from hobble.core.files import read_json, write_json
from hobble.hurt.options import Hurt
from hobble.hurt.version import hurt_version
from hobble.labels.label import write_report
from hobble.labels.model import LabelReport, load_labels, save_labels
from hobble.workflow.job import job

with job(snakemake) as log:
    clip = load_clip(snakemake.input.clip)
    report = LabelReport.from_dict(read_json(snakemake.input.label_report))
    hurt, report = hurt_version(
        clip,
        load_labels(snakemake.input.labels),
        report,
        Hurt.model_validate(snakemake.params.options),
        name=snakemake.params.clip,
        turn=snakemake.params.turn,
        ground=snakemake.params.ground,
    )
    links = clip.skeleton.link_names
    save_clip(snakemake.output.clip, hurt.clip)
    write_json(
        snakemake.output.report,
        {**read_json(snakemake.input.report), "clip": hurt.clip.name, "hurt_of": clip.name},
    )
    save_labels(snakemake.output.labels, hurt.labels)
    write_report(snakemake.output.label_report, report, hurt.labels, hurt.clip)
    save_values(snakemake.output.injury, hurt.severity, links)
    write_channel_report(snakemake.output.injury_report, "injury", hurt.clip, hurt.severity, links, [])
    log.info("%s: %d frames from %d of %s", hurt.clip.name, len(hurt.clip), len(clip), clip.name)
