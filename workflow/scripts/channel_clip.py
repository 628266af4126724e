"""Creates the values of one channel in each frame of a clip, from the sources that the data set names."""

from hobble.channels import channel
from hobble.channels.files import clip_values, save_values, write_report
from hobble.core.clip import load_clip
from hobble.core.files import read_json
from hobble.workflow.job import job

with job(snakemake) as log:
    name, clip = snakemake.params.channel, load_clip(snakemake.input.clip)
    files = snakemake.input.get("files", [])
    files = [files] if isinstance(files, str) else files
    source = channel(name).source(snakemake.params.source, files)
    values, warnings = clip_values(name, clip, source, read_json(snakemake.input.report))
    for warning in warnings:
        log.warning("%s", warning)
    labels = channel(name).columns(clip.skeleton)
    save_values(snakemake.output["values"], values, labels)
    write_report(snakemake.output.report, name, clip, values, labels, warnings)
