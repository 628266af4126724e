"""Creates the severities of a mirrored clip from those of its original."""

from hobble.channels.injury.severity import load_injury, mirror_severity, save_injury, write_report
from hobble.core.clip import load_clip
from hobble.core.files import read_json
from hobble.workflow.job import job

with job(snakemake):
    clip = load_clip(snakemake.input.clip)
    severity, links = load_injury(snakemake.input.injury)
    severity = mirror_severity(severity, clip.skeleton.mirror_links)
    warnings = read_json(snakemake.input.report)["warnings"]
    save_injury(snakemake.output.injury, severity, links)
    write_report(snakemake.output.report, clip, severity, links, warnings)
