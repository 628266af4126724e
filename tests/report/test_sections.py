from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from hobble.core.errors import InputError
from hobble.core.files import read_numbers
from hobble.core.skeleton import Skeleton
from hobble.measures import accuracy as accuracy_page
from hobble.report import data_section, sections
from hobble.report.gather import ReportMaterial, describe_network
from hobble.report.parts import Chart
from hobble.report.recorded_motion import ground_pictures
from hobble.rows.clip_rows import load_clip_rows, save_clip_rows


def test_sections_of_a_pass_are_spread_evenly_on_the_axis(material: ReportMaterial) -> None:
    x = sections.passes_axis(material.history)
    assert (x[0], x[9], x[10], x[-1]) == (pytest.approx(0.1), 1.0, pytest.approx(1.1), 20.0)


def test_empty_cells_of_the_history_are_read_and_words_refused(tmp_path: Path) -> None:
    path = tmp_path / "history.csv"
    path.write_text("pass,held_out_mse\n1,\n2,0.5\n")
    assert read_numbers(path) == {"pass": [1.0, 2.0], "held_out_mse": [None, 0.5]}
    path.write_text("pass,held_out_mse\n1,good\n")
    with pytest.raises(InputError, match="column held_out_mse holds 'good'"):
        read_numbers(path)
    path.write_text("pass,held_out_mse\n1\n2,inf\n")
    assert read_numbers(path) == {"pass": [1.0, 2.0], "held_out_mse": [None, None]}
    for text in ("", 'pass,held_out_mse\n1,"2\n', "pass\n1,2,3\n1,2,3,4\n"):
        path.write_text(text)
        with pytest.raises(InputError, match=r"history\.csv.*not a table of numbers"):
            read_numbers(path)


def test_a_learning_curve_needs_no_held_out_clips(material: ReportMaterial) -> None:
    nothing = {**material.history, "held_out_mse": [None] * 200}
    chart = sections.learning_curve(replace(material, history=nothing))
    assert [trace["name"] for trace in chart.traces] == ["training"]


def test_a_file_that_holds_no_weights_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "weights.npz"
    path.write_bytes(b"nothing")
    with pytest.raises(InputError, match="damaged or not an npz file"):
        describe_network(path)


def test_bars_show_every_clip_of_its_split(material: ReportMaterial) -> None:
    chart = accuracy_page.clip_bars(material.results_of("accuracy"), material)
    assert chart is not None
    bars = {trace["name"]: dict(zip(trace["y"], trace["x"], strict=True)) for trace in chart.traces}
    assert set(bars["held out"]) == {"walk_turns", "walk_turns_mirror", "hurt_back", "hurt_back_mirror"}
    assert len(bars["training"]) == 12
    row = next(r for r in material.measurements["accuracy"]["clips"] if r["clip"] == "jog")
    assert bars["training"]["jog"] == pytest.approx(100 * row["mean"])
    assert set(chart.layout["yaxis"]["categoryarray"]) == set(bars["held out"]) | set(bars["training"])


def test_boxes_only_where_there_are_quantiles(material: ReportMaterial) -> None:
    assert accuracy_page.clip_boxes(material.results_of("accuracy")) is not None
    clips = [
        {k: v for k, v in row.items() if k != "p50"} for row in material.measurements["accuracy"]["clips"]
    ]
    assert accuracy_page.clip_boxes({"clips": clips}) is None


def test_gait_seconds_add_up(material: ReportMaterial) -> None:
    chart = data_section.gait_chart(material)
    assert chart is not None
    drawn = sum(sum(trace["y"]) for trace in chart.traces)
    assert drawn == pytest.approx(sum(sum(r["seconds"].values()) for r in material.labels))


def test_turns_speeds_and_severities_are_counted_in_seconds(
    examples: ModuleType, holden31: Skeleton, tmp_path: Path
) -> None:
    rows = load_clip_rows(examples.rows(tmp_path / "walk.npz", holden31))
    y, severity = np.array(rows.y), np.zeros_like(rows.channels["injury"])
    y[:, rows.layout.y_root_velocity] = [0.0, 2.05]  # 1.23 m/s
    y[:, rows.layout.y_turn] = np.radians(-30.0) / 60  # the world turns right, the figure left
    knee = holden31.link_names.index("LeftUpLeg-LeftLeg")
    severity[: len(rows) // 2, knee] = 7.2
    save_clip_rows(tmp_path / "walk.npz", replace(rows, y=y, channels={"injury": severity}))
    found = data_section.seconds_of_data([tmp_path / "walk.npz"], {rows.clip: "held_out"})
    seconds, hurt = len(np.unique(rows.frame)) / 60, len(np.unique(rows.frame[: len(rows) // 2])) / 60
    turns = dict(zip(data_section._middles(data_section.TURN_EDGES), found["turns"]["held_out"], strict=True))
    assert turns[30.0] == pytest.approx(seconds)
    assert sum(turns.values()) == pytest.approx(seconds)
    assert not found["turns"]["train"].any()
    row, column = np.argwhere(found["both"] > 0)[0]
    assert (
        data_section._middles(data_section.TURN_EDGES)[row],
        data_section._middles(data_section.SPEED_EDGES)[column],
    ) == (
        30.0,
        1.3,
    )
    assert list(found["channels"]["injury"]) == ["LeftUpLeg-LeftLeg"]
    assert found["channels"]["injury"]["LeftUpLeg-LeftLeg"][6] == pytest.approx(hurt, abs=1 / 60 + 1e-9)
    (chart,) = data_section.channel_charts(found)
    assert chart is not None
    assert chart.traces[0]["z"][0][6] == pytest.approx(hurt, abs=0.02)


def test_strips_show_the_injured_parts(material: ReportMaterial) -> None:
    strips = {
        strip["clip"]: strip
        for strip in data_section.clip_strips(material, data_section.choose_clips(material))
    }
    assert len(strips) == 8, "a mirror says the same again"
    (row,) = strips["hurt_left_knee"]["channels"]
    assert row["name"] == "left thigh"
    assert row["spans"][0][2] == 7.0
    assert strips["jog"]["channels"] == []


def test_stages_are_listed_with_published_values_of_the_same_configuration(material: ReportMaterial) -> None:
    """A published time or size is shown only for its own configuration."""
    nothing, patches = [None, None], [1680, 606.0e6]
    known = {
        "holden": {"terrain": patches, "database": [5400, 7.12e9], "training": [43 * 3600, 122.0e6]},
        "holden-xl": {"training": [47 * 3600, 176.0e6]},
        "holden-xt": {"training": [91 * 3600, None]},
        "ava": {"database": [55 * 60, 10.4e9], "training": [31 * 3600, 374.0e6]},
        "ferre": {"training": [50 * 3600, None]},
        "example": {},
    }
    for name, theirs in known.items():
        table = sections.stage_table(replace(material, name=name))
        if not theirs:
            assert [c.label for c in table.columns if "published" in c.label] == []
            continue
        assert {row[0]: row[-2:] for row in table.rows} == {
            stage["stage"]: theirs.get(stage["stage"], nothing) for stage in material.pipeline["stages"]
        }


def test_ground_profiles_hold_the_present_height_under_the_root(tmp_path: Path) -> None:
    heights = np.arange(6 * 3 * 36, dtype=np.float32).reshape(18, 36)
    path = tmp_path / "clip.npz"
    np.savez(
        path, frame=np.arange(6), fits=np.full(6, 3), heights=heights, error=np.zeros((1, 10)),
        foot_error=np.zeros((1, 10, 2)),
    )  # fmt: skip
    fits = sections.read_fits(path)
    assert fits.frame.tolist() == [0, 3]
    # Of 12 centre samples, -60 to +50 by tens, the seventh is the present one: column 12 + 6.
    assert fits.profile.tolist() == [heights[0:3, 18].tolist(), heights[9:12, 18].tolist()]


def test_a_damaged_terrain_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "clip.npz"
    np.savez(path, frame=np.arange(3))
    with pytest.raises(InputError, match=r"clip\.npz: holds no array 'fits'"):
        sections.read_fits(path)


def test_flat_clips_have_no_ground_to_show(material: ReportMaterial) -> None:
    section = sections.terrain_section(material.terrain_files)
    assert len(section["table"].rows) == 6
    assert "hurt_back" not in section["charts"][0].options
    pictures = ground_pictures(material.terrain_files, material.network["skeleton"])["pictures"]
    assert [p["name"] for p in pictures][:2] == ["walk_straight, cycle 2", "walk_turns, cycle 2"]


def test_texts_are_escaped_for_plotly() -> None:
    chart = Chart("c", "t", "", [{"type": "bar", "y": ["<b>a & b"], "hovertemplate": "%{y}<extra></extra>"}])
    (trace,) = chart.spec()["traces"]
    assert trace["y"] == ["&lt;b>a &amp; b"]
    assert trace["hovertemplate"] == "%{y}<extra></extra>"


def test_examples_are_seeded(examples: ModuleType, holden31: Any, tmp_path: Path) -> None:
    for name in ("a", "b"):
        examples.scenarios(tmp_path / f"{name}.npz", holden31)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_each_clip_on_other_bones_has_one_bar_and_mirrors_none(material):
    def figures(knee: float, thigh: float) -> dict:
        return {"angles": {"left knee": {"apart": knee}}, "directions": {"right thigh": thigh}}

    clips = {
        "near": figures(2.0, 1.0),
        "far": figures(3.0, 9.5),
        "far_mirror": figures(3.0, 9.5),
        "own": None,
    }
    reports = [{"clip": name, "retarget": value} for name, value in clips.items()]
    chart = data_section.retarget_chart(replace(material, motion=reports))
    (bars,) = chart.traces
    assert (bars["x"], bars["y"], bars["text"]) == (["far", "near"], [9.5, 2.0], ["right thigh", "left knee"])
    assert data_section.retarget_chart(replace(material, motion=reports[-1:])) is None
