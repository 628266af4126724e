from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton
from hobble.report import data_section, sections
from hobble.report.gather import ReportMaterial, describe_network
from hobble.report.parts import Chart
from hobble.rows.clip_rows import load_clip_rows, save_clip_rows


def test_sections_of_a_pass_are_spread_evenly_on_the_axis(material: ReportMaterial) -> None:
    x = sections.passes_axis(material.history)
    assert (x[0], x[9], x[10], x[-1]) == (pytest.approx(0.1), 1.0, pytest.approx(1.1), 20.0)


def test_a_file_that_holds_no_weights_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "weights.npz"
    path.write_bytes(b"nothing")
    with pytest.raises(InputError, match="damaged or not an npz file"):
        describe_network(path)


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


def test_the_chart_of_labels_shows_the_injured_parts(material: ReportMaterial) -> None:
    chart = data_section.label_chart(material, data_section.choose_clips(material))
    assert chart is not None
    assert len(chart.options) == 8, "a mirror says the same again"
    bars = {clip: [t for t in traces if t.get("yaxis") == "y5"] for clip, traces in chart.options.items()}
    (bar,) = bars["hurt_left_knee"]
    assert (bar["y"], bar["opacity"]) == (["left thigh"] * 2, pytest.approx(0.15 + 0.85 * 0.7))
    assert bars["jog"] == []
    gaits = [t["y"] for t in chart.options["jog"] if t.get("yaxis") == "y3"]
    assert np.sum(gaits, axis=0) == pytest.approx(1, abs=0.02)


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


def test_texts_are_escaped_for_plotly() -> None:
    chart = Chart("c", "t", "", [{"type": "bar", "y": ["<b>a & b"], "hovertemplate": "%{y}<extra></extra>"}])
    (trace,) = chart.spec()["traces"]
    assert trace["y"] == ["&lt;b>a &amp; b"]
    assert trace["hovertemplate"] == "%{y}<extra></extra>"


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
