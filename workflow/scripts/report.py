"""Creates results/<configuration>/report.html from the measurements, clip reports and generated motion."""

from pathlib import Path

from hobble.core.files import write_text
from hobble.models.load import load_network
from hobble.report.captured_and_predicted import packed_comparisons
from hobble.report.gather import gather
from hobble.report.opening_walk import opening_walk
from hobble.report.pack_recogniser import playable_with_recogniser
from hobble.report.page import render_report
from hobble.report.scenes import packed_scenes
from hobble.runtime.options import Runtime
from hobble.workflow.job import job

with job(snakemake):
    given, params = snakemake.input, snakemake.params
    material = gather(
        name=params.configuration,
        dataset=params.dataset,
        title=params.title,
        splits=params.splits,
        configuration=given.configuration,
        measured=given.measured,
        pipeline=given.pipeline,
        history=given.history,
        weights=given.weights,
        motion=given.motion,
        labels=given.labels,
        channels=given.channels,
        terrain=given.terrain,
        rows=given.rows,
    )
    network = material.network
    play = packed_scenes(given.scenarios, network["skeleton"], network["channels"])
    trained = load_network(given.weights)
    runtime = Runtime.model_validate(material.resolved["configuration"]["runtime"])
    character = playable_with_recogniser(trained, runtime)
    hero = opening_walk(trained, runtime, character, material.measured.values())
    compared = packed_comparisons(trained, given.rows, params.splits)
    bundle = Path(given.bundle).read_text(encoding="utf-8")
    write_text(snakemake.output.html, render_report(material, play, character, compared, bundle, hero))
