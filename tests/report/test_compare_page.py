"""The page that compares configurations."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import yaml

from hobble.core.skeleton import Skeleton
from hobble.measures import accuracy as of_accuracy
from hobble.measures import responsivity as of_laps
from hobble.measures.compare import ConfigurationResults, compare_configurations
from hobble.measures.measure import all_measures
from hobble.models.load import load_network
from hobble.report import compare_page
from hobble.report.character import coarse_weights, playable_data
from hobble.report.compare_page import render_comparison
from hobble.report.gather import PUBLISHED, ReportMaterial


@pytest.fixture(scope="module")
def compared(material: ReportMaterial) -> dict[str, Any]:
    """Two configurations: the example, and one with half of its error and twice its time."""
    resolved = {
        "configuration": {
            "dataset": "made_up",
            "channels": ["injury"],
            "network": {"hidden_layers": 2, "units": 16, "control_points": 4},
            "training": {"passes": 3},
        }
    }
    counts = {"true": 5000, "table_6_1": 4000, "table_6_1_as_printed": 3000}
    better = [{**row, "mean": row["mean"] / 2} for row in material.measurements["accuracy"]["clips"]]
    results = []
    for name, clips, factor in (
        ("holden", material.measurements["accuracy"]["clips"], 1),
        ("ava", better, 2),
    ):
        responsivity = {
            **material.measurements["responsivity"],
            "parameters": {k: factor * v for k, v in counts.items()},
            "bytes_each": 4,
            "stored": {"cubic": 4 * factor * counts["true"]},
            "exact": "cubic",
        }
        splits = {
            s: {
                **part,
                "mean": part["mean"] / factor,
                "mean_of_clips": part["mean"] / factor,
                **{f"p{q:02}": part["mean"] * q / 50 / factor for q in (5, 25, 50, 75, 95)},
            }
            for s, part in ((s, material.measurements["accuracy"][s]) for s in ("train", "held_out"))
        }
        lengths = [
            {
                "length": n,
                "clips": [],
                **{s: {"position_error_cm": n * factor} for s in ("train", "held_out")},
            }
            for n in (1, 10)
        ]
        results.append(
            ConfigurationResults(
                name=name,
                resolved=resolved,
                measurements={
                    "accuracy": {**material.measurements["accuracy"], **splits, "clips": clips, "joints": 31},
                    "rollouts": {"lengths": lengths},
                    "responsivity": responsivity,
                    "injury": material.measurements["injury"],
                    "recognition": {"applies": False, "reason": "not tried"},
                },
                pipeline=material.pipeline,
                history=material.history,
            )
        )
    return compare_configurations(results, yaml.safe_load(PUBLISHED.read_text()))


@pytest.fixture(scope="module")
def pair(
    character: dict[str, Any], examples: ModuleType, holden31: Skeleton, tmp_path_factory: Any
) -> dict[str, Any]:
    """Two characters, of which one cannot be hurt."""
    path = tmp_path_factory.mktemp("pair") / "weights.npz"
    examples.weights(path, holden31, links=False)
    return {"holden": character, "ava": playable_data(load_network(path), examples.RUNTIME)}


@pytest.fixture(scope="module")
def tab(
    compared: dict[str, Any], pair: dict[str, Any], script: str, tools: ModuleType, tmp_path_factory: Any
) -> Iterator[Any]:
    page = render_comparison(compared, pair, script, measures=all_measures())
    yield from tools.opened(page, tmp_path_factory.mktemp("compared"))


def test_boxes_are_at_the_quantiles_with_published_means(compared: dict[str, Any]) -> None:
    chart = of_accuracy.error_boxes(compared)
    assert chart is not None
    boxes = [t for t in chart.options["held-out clips"] if t["type"] == "box"]
    assert [box["name"] for box in boxes] == ["holden", "ava"]
    assert boxes[0]["q3"][0] == pytest.approx(1.5 * boxes[0]["mean"][0])
    assert boxes[0]["mean"][0] == pytest.approx(2 * boxes[1]["mean"][0])
    (points,) = [t for t in chart.options["held-out clips"] if t["type"] == "scatter"]
    assert dict(zip(points["x"], points["y"], strict=True)) == pytest.approx({"holden": 4.39, "ava": 1.48})


def test_published_clips_and_laps_are_drawn_beside_ours(compared: dict[str, Any]) -> None:
    """Figures 5.1, 5.2, 5.6, 5.7 and 5.11 of Segerstedt, and his tables of the appendix."""
    lines = of_accuracy.clip_lines(compared)
    assert lines is not None
    means = {trace["name"]: trace for trace in lines.options["mean"]}
    assert set(means) == {"holden", "holden, published", "ava", "ava, published"}
    assert means["holden, published"]["y"][0] == pytest.approx(4.96)
    assert means["holden, published"]["x"][1] == "LocomotionFlat01_000_mirror"
    assert "ava, published" not in {trace["name"] for trace in lines.options["standard deviation"]}
    laps = {trace["name"]: trace for trace in of_laps.lap_lines(compared).options["constant phase"]}
    assert (len(laps["ava, published"]["y"]), laps["ava, published"]["y"][-1]) == (19, 1.397291)
    assert [t["name"] for t in of_laps.lap_boxes(compared).traces][:2] == [
        "holden, ours",
        "holden, published",
    ]
    chart = compare_page.training_curves(compared)
    assert chart is not None
    (curve,) = [t for t in chart.options["passes"] if t["name"] == "holden, published"]
    assert (curve["x"][-1], curve["y"][0], curve["y"][-1]) == (20, 0.442, 0.254)


def test_published_figures_are_shown_with_ours(compared: dict[str, Any]) -> None:
    rows = {(row[0], row[1]): row[2:4] for row in compare_page.published_table(compared).rows}
    assert rows["a frame, mean", "holden"][0] == "0.376 ms"
    assert rows["a frame, mean", "holden"][1].endswith(" ms")
    assert rows["relative error, held-out clips", "holden-xl"] == ["0.0448", ""]
    assert rows["database, on disk", "holden"] == ["7.12 GB", "30 MB"]
    assert rows["database, time", "holden"] == ["1 h 30 min", "21 s"]
    of_clips = {row[0] for row in compare_page.published_table(compared).rows if "80 clips" in row[4]}
    assert of_clips == {
        f"{what} {split} clips"
        for what in ("relative error,", "standard deviation of the means of")
        for split in ("training", "held-out")
    }
    cited = {(row[0], row[1]): row[4] for row in compare_page.published_table(compared).rows}
    assert cited["a frame, mean", "ava"] == "Segerstedt (2021), Table 5.1 (but 1.479 and .0326 by Table A.3)"
    assert cited["relative error, training clips", "ava"].endswith(
        ", Table 5.2 (but .0311 and .00448 by Table A.4)"
    )


def test_networks_too_large_for_one_page_are_left_out(
    compared: dict[str, Any], pair: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = len(render_comparison(compared, {"holden": pair["holden"]}).encode())
    monkeypatch.setattr(compare_page, "LARGEST_PAGE", alone - 10_000 + compare_page.RESERVED)
    page = render_comparison(compared, pair)
    assert len(page.encode()) < alone + compare_page.RESERVED
    assert "weights have 9 bits here" in page
    alone = len(render_comparison(compared, {"holden": coarse_weights(pair["holden"])}).encode())
    monkeypatch.setattr(compare_page, "LARGEST_PAGE", alone + compare_page.RESERVED)
    page = render_comparison(compared, pair)
    assert "to keep the file small: ava" in page
    assert 'id="play-second"' not in page


@pytest.mark.slow
def test_two_figures_get_the_same_targets(tab: Any) -> None:
    tab.run("document.getElementById('play-view').scrollIntoView({ behavior: 'instant', block: 'center' })")
    tab.run("document.getElementById('play-stage').focus({ preventScroll: true })")
    assert tab.run("Hobble.player.actors.length") == 2
    tab.send("Input.dispatchKeyEvent", type="keyDown", key="w", code="KeyW", text="w")
    where = "Hobble.player.actors.map(({ character: { root: [x, , z] } }) => [x, z])"
    before = np.array(tab.run(where))
    assert tab.until("Math.hypot(...(Hobble.player.target?.velocity ?? [0])) > 2")
    assert tab.until("Hobble.player.actors.every(({ frames }) => frames.length > 60)", 60)
    first, second = np.array(tab.run(where)) - before
    tab.send("Input.dispatchKeyEvent", type="keyUp", key="w", code="KeyW")
    assert first[0] * second[0] + first[1] * second[1] > 0
    tab.run("[...document.querySelectorAll('#play-presets button')][0].click()")
    hurt = "Math.max(0, ...Hobble.player.actors[{0}].character.values)"
    assert tab.until(f"{hurt.format(0)} > .1")
    assert tab.run(hurt.format(1)) == 0
    assert "holden" in tab.run("document.getElementById('play-panel').textContent")


@pytest.mark.slow
def test_charts_are_drawn_without_console_messages_or_requests(tab: Any, pictures: Path) -> None:
    tab.run("Hobble.drawAll()")
    undrawn = (
        "[...document.querySelectorAll('[data-chart]')].filter((e) => !e.querySelector('.main-svg')).length"
    )
    assert tab.run(undrawn) == 0
    for section in ("summary", "play", "accuracy", "speed", "training", "costs", "published"):
        tab.picture(pictures / f"compare-{section}.png", f"#{section}")
    assert tab.console == []
    assert all(url.startswith(("file:", "data:", "blob:", "about:")) for url in tab.requests)
