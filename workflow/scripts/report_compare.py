"""Creates results/compare/report.html from compare.json and the networks of the configurations."""

from pathlib import Path

import yaml

from hobble.core.files import read_json, write_text
from hobble.models.load import load_network
from hobble.report.compare_page import render_comparison
from hobble.report.pack_recogniser import playable_with_recogniser
from hobble.report.rounded_weights import has_weights, rounding_error
from hobble.runtime.options import Runtime
from hobble.workflow.job import job

with job(snakemake):
    given = snakemake.input
    playables, errors, seen = {}, {}, set()
    for name, weights, resolved in zip(
        snakemake.params.configurations, given.weights, given.configuration, strict=True
    ):
        if weights not in seen:  # a network that two configurations read is one character
            section = yaml.safe_load(Path(resolved).read_text(encoding="utf-8"))["configuration"]["runtime"]
            runtime, network = Runtime.model_validate(section), load_network(weights)
            playables[name] = playable_with_recogniser(network, runtime)
            if playables[name] and has_weights(playables[name]):
                errors[name] = rounding_error(network, runtime)
        seen.add(weights)
    bundle = Path(given.bundle).read_text(encoding="utf-8")
    page = render_comparison(read_json(given.compared), playables, bundle, errors)
    write_text(snakemake.output.html, page)
