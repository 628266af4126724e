"""Creates results/compare/report.html from compare.json and the networks of the configurations."""

from pathlib import Path

import yaml

from hobble.core.files import read_json, write_text
from hobble.measures.measure import all_measures
from hobble.models.load import load_network
from hobble.report.character import has_weights, playable_with_recogniser, rounding_error
from hobble.report.compare_page import render_comparison
from hobble.runtime.options import Runtime
from hobble.workflow.job import job

with job(snakemake):
    files = snakemake.input
    characters, errors, seen = {}, {}, set()
    for name, weights, resolved in zip(
        snakemake.params.configurations, files.weights, files.configuration, strict=True
    ):
        if weights not in seen:  # configurations with the same weights file have the same character
            options = yaml.safe_load(Path(resolved).read_text(encoding="utf-8"))["configuration"]["runtime"]
            runtime, network = Runtime.model_validate(options), load_network(weights)
            characters[name] = playable_with_recogniser(network, runtime)
            if characters[name] and has_weights(characters[name]):
                errors[name] = rounding_error(network, runtime)
        seen.add(weights)
    bundle = Path(files.bundle).read_text(encoding="utf-8")
    page = render_comparison(read_json(files.compared), characters, bundle, errors, all_measures())
    write_text(snakemake.output.html, page)
