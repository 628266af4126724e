"""Creates results/<configuration>/report.html from the measurements, clip reports and generated motion."""

from pathlib import Path

from hobble.core.files import write_text
from hobble.measures.measure import all_measures
from hobble.models.load import load_network
from hobble.report.character import packed_comparisons, playable_with_recogniser
from hobble.report.gather import gather
from hobble.report.page import render_report
from hobble.runtime import Runtime
from hobble.workflow.job import Inputs, job

with job(snakemake):
    files, params = snakemake.input, snakemake.params
    find = Inputs(files.batches)

    def of_clips(name):
        """The files with this name, which contains {clip}, for all clips."""
        return list(find.each(name, params.splits).values())

    rows = of_clips("database/clips/{clip}.npz")
    material = gather(
        name=params.configuration,
        dataset=params.dataset,
        title=params.title,
        splits=params.splits,
        configuration=files.configuration,
        measurements=files.measurements,
        pipeline=files.pipeline,
        history=files.history,
        weights=files.weights,
        motion=of_clips("motion/{clip}.json"),
        labels=of_clips("labels/{clip}.json"),
        channels=[f for name in params.channels for f in of_clips(f"channels/{name}/{{clip}}.json")],
        terrain=of_clips("terrain/clips/{clip}.npz"),
        rows=rows,
        measures=all_measures(),
    )
    network = load_network(files.weights)
    runtime = Runtime.model_validate(material.resolved["configuration"]["runtime"])
    character = playable_with_recogniser(network, runtime)
    captured_and_predicted = packed_comparisons(network, rows, params.splits)
    bundle = Path(files.bundle).read_text(encoding="utf-8")
    page = render_report(material, character, captured_and_predicted, bundle)
    write_text(snakemake.output.html, page)
