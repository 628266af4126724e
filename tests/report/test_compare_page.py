"""The page that compares configurations."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import yaml

from hobble.measures import accuracy as of_accuracy
from hobble.measures import responsivity as of_laps
from hobble.measures.compare import ConfigurationResults, compare_configurations
from hobble.measures.measure import all_measures
from hobble.models.network import Network
from hobble.report import page as pages
from hobble.report.character import playable_data
from hobble.report.gather import PUBLISHED, ReportMaterial
from hobble.runtime import Runtime
from tests.report.browser import Browser, opened


@pytest.fixture(scope="module")
def compared(material: ReportMaterial) -> dict[str, Any]:
    """Two configurations: the run, and one with half of its error."""

    def halved(value: Any) -> Any:
        if isinstance(value, dict):
            kept = {"frames", "clip", "split", "joints"}
            return {key: item if key in kept else halved(item) for key, item in value.items()}
        if isinstance(value, list):
            return [halved(item) for item in value]
        return value / 2 if isinstance(value, float) else value

    better = {**material.measurements, "accuracy": halved(material.measurements["accuracy"])}
    results = [
        ConfigurationResults(name, material.resolved, measurements, material.pipeline, material.history)
        for name, measurements in (("holden", material.measurements), ("ava", better))
    ]
    return compare_configurations(results, yaml.safe_load(PUBLISHED.read_text()))


@pytest.fixture(scope="module")
def pair(character: dict[str, Any], network: Network, runtime: Runtime) -> dict[str, Any]:
    """Two characters, of which one was never hurt in training."""
    mean = network.x_mean.copy()
    mean[network.layout.x_channel("injury")] = 0
    return {"holden": character, "ava": playable_data(replace(network, x_mean=mean), runtime)}


@pytest.fixture(scope="module")
def tab(
    compared: dict[str, Any], pair: dict[str, Any], script: str, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Browser]:
    page = pages.render_comparison(compared, pair, script, measures=all_measures())
    yield from opened(page, tmp_path_factory.mktemp("compared"))


def test_published_errors_laps_and_curves_are_drawn_beside_ours(compared: dict[str, Any]) -> None:
    """Figures 5.1, 5.2, 5.6, 5.7 and 5.11 of Segerstedt, and his tables of the appendix."""
    boxes = of_accuracy.error_boxes(compared)
    assert boxes is not None
    names = [t["name"] for t in boxes.options["held-out clips"] if t["type"] == "box"]
    assert names == [f"{name}, {whose}" for name in ("holden", "ava") for whose in ("ours", "published")]
    (points,) = [t for t in boxes.options["held-out clips"] if t["type"] == "scatter"]
    assert dict(zip(points["x"], points["y"], strict=True)) == pytest.approx({"holden": 4.39, "ava": 1.48})
    laps = {trace["name"]: trace for trace in of_laps.lap_boxes(compared).options["constant phase"]}
    assert (len(laps["ava, published"]["y"]), laps["ava, published"]["y"][-1]) == (19, 1.397291)
    chart = pages.training_curves(compared)
    assert chart is not None
    (curve,) = [t for t in chart.options["passes"] if t["name"] == "holden, published"]
    assert (curve["x"][-1], curve["y"][0], curve["y"][-1]) == (20, 0.442, 0.254)


@pytest.mark.slow
def test_two_figures_get_the_same_targets_and_charts_are_drawn(tab: Browser) -> None:
    tab.run("document.getElementById('play-view').scrollIntoView({ behavior: 'instant', block: 'center' })")
    tab.run("document.getElementById('play-stage').focus({ preventScroll: true })")
    assert tab.run("Hobble.player.actors.length") == 2
    tab.send("Input.dispatchKeyEvent", type="keyDown", key="w", code="KeyW", text="w")
    where = "Hobble.player.actors.map(({ character: { root: [x, , z] } }) => [x, z])"
    before = np.array(tab.run(where))
    assert tab.until("Hobble.player.actors.every(({ frames }) => frames.length > 60)", 60)
    first, second = np.array(tab.run(where)) - before
    tab.send("Input.dispatchKeyEvent", type="keyUp", key="w", code="KeyW")
    assert first @ second > 0
    tab.run("Hobble.player.sliders.change(Hobble.player.sliders.channels[0], 'RightLeg-RightFoot', 1)")
    hurt = "Math.max(0, ...Hobble.player.actors[0].character.values)"
    assert tab.until(f"{hurt} > .1")
    assert "holden" in tab.run("document.getElementById('play-panel').textContent")
    tab.run("Hobble.drawAll()")
    undrawn = (
        "[...document.querySelectorAll('[data-chart]')].filter((e) => !e.querySelector('.main-svg')).length"
    )
    assert tab.run(undrawn) == 0
    assert tab.fetched == []
