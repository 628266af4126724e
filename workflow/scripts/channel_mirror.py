"""Creates the values of one channel in each frame of a mirrored clip from those of its original."""

from hobble.channels import channel
from hobble.channels.files import load_values, save_values, write_report
from hobble.core.clip import load_clip
from hobble.core.files import read_json
from hobble.workflow.job import job

with job(snakemake):
    name, clip = snakemake.params.channel, load_clip(snakemake.input.clip)
    values, labels = load_values(snakemake.input["values"])
    values = channel(name).mirror(values, clip.skeleton)
    warnings = read_json(snakemake.input.report)["warnings"]
    save_values(snakemake.output["values"], values, labels)
    write_report(snakemake.output.report, name, clip, values, labels, warnings)
