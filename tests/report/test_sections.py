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
    of_split = found["both"]["held_out"]
    row, column = np.argwhere(of_split > 0)[0]
    assert of_split[row, column] == of_split.sum() == pytest.approx(seconds)
    middles = data_section._middles(data_section.TURN_EDGES), data_section._middles(data_section.SPEED_EDGES)
    assert (middles[0][row], middles[1][column]) == (30.0, 1.3)
    assert not found["both"]["train"].any()
    assert list(found["channels"]["injury"]) == ["LeftUpLeg-LeftLeg"]
    assert found["channels"]["injury"]["LeftUpLeg-LeftLeg"][6] == pytest.approx(hurt, abs=1 / 60 + 1e-9)
    (chart,) = data_section.channel_charts(found)
    assert chart is not None
    assert chart.traces[0]["z"][0][6] == pytest.approx(hurt, abs=0.02)


def test_fits_of_uneven_ground_are_listed_with_the_farthest_feet_first(tmp_path: Path) -> None:
    for name, fits, distance in (("near", 10, 0.1), ("far", 10, 0.4), ("flat", 1, 0.0)):
        feet = np.full((2, fits, 2), distance) * [1, 2]
        error = np.arange(2.0 * fits).reshape(2, fits)
        np.savez(tmp_path / f"{name}.npz", error=error, foot_error=feet)
    table = sections.fit_table(sorted(tmp_path.glob("*.npz")))
    assert table is not None
    assert [row[0] for row in table.rows] == ["far", "near"]
    assert table.rows[0][1:] == pytest.approx([2, 0.4, 0.8, 5.0, 14.0])
    assert sections.fit_table([tmp_path / "flat.npz"]) is None
    np.savez(tmp_path / "near.npz", frame=np.arange(3))
    with pytest.raises(InputError, match=r"near\.npz: holds no array 'foot_error'"):
        sections.fit_table([tmp_path / "near.npz"])


def test_texts_are_escaped_for_plotly() -> None:
    chart = Chart("c", "t", "", [{"type": "bar", "y": ["<b>a & b"], "hovertemplate": "%{y}<extra></extra>"}])
    (trace,) = chart.spec()["traces"]
    assert trace["y"] == ["&lt;b>a &amp; b"]
    assert trace["hovertemplate"] == "%{y}<extra></extra>"


def test_retargeted_clips_that_differ_most_come_first(material: ReportMaterial) -> None:
    def figures(knee: float, thigh: float) -> dict:
        return {"angles": {"left knee": {"apart": knee}}, "directions": {"right thigh": thigh}}

    clips = {"own": None, "near": figures(2.0, 1.0), "far": figures(3.0, 9.5)}
    reports = [
        {**report, "retarget": value} for report, value in zip(material.motion, clips.values(), strict=False)
    ]
    table = data_section.clip_table(replace(material, motion=reports))
    assert [row[-2:] for row in table.rows] == [[9.5, "right thigh"], [2.0, "left knee"], [None, None]]
    table = data_section.clip_table(replace(material, motion=reports[:1]))
    assert table.columns[-1].label == "SHA-256"
