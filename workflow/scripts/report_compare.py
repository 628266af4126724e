"""Creates results/compare/report.html from compare.json and the networks of the configurations."""

from pathlib import Path

import yaml

from hobble.core.files import read_json, write_text
from hobble.measures.measure import all_measures
from hobble.models.load import load_network
from hobble.report.character import playable_with_recogniser
from hobble.report.page import render_comparison
from hobble.runtime import Runtime
from hobble.workflow.job import job

with job(snakemake):
    files = snakemake.input
    characters, seen = {}, set()
    for name, weights, resolved in zip(
        snakemake.params.configurations, files.weights, files.configuration, strict=True
    ):
        if weights not in seen:  # configurations with the same weights file have the same character
            options = yaml.safe_load(Path(resolved).read_text(encoding="utf-8"))["configuration"]["runtime"]
            runtime = Runtime.model_validate(options)
            characters[name] = playable_with_recogniser(load_network(weights), runtime)
        seen.add(weights)
    bundle = Path(files.bundle).read_text(encoding="utf-8")
    page = render_comparison(read_json(files.compared), characters, bundle, all_measures())
    write_text(snakemake.output.html, page)
