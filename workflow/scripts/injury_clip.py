"""Creates the severities of a clip from its status file, or from what its data set says of it."""

from hobble.channels.injury.severity import clip_severity, save_injury, write_report
from hobble.core.clip import load_clip
from hobble.core.files import read_json
from hobble.workflow.job import job

with job(snakemake) as log:
    clip = load_clip(snakemake.input.clip)
    files = snakemake.input.get("status", [])
    severity, warnings = clip_severity(
        clip,
        next(iter([files] if isinstance(files, str) else files), None),
        snakemake.params.status,
        read_json(snakemake.input.report),
    )
    for warning in warnings:
        log.warning("%s", warning)
    links = clip.skeleton.link_names
    save_injury(snakemake.output.injury, severity, links)
    write_report(snakemake.output.report, clip, severity, links, warnings)
