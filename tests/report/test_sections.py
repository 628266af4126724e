"""What stands in the sections: parts, tables, hints, key figures, and the injury that the page opens with."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.core.errors import InputError
from hobble.models.network import Network
from hobble.report import sections
from hobble.report.character import opening_slider
from hobble.report.gather import ReportMaterial, describe_network
from hobble.report.page import hints, key_figures
from hobble.report.parts import (
    Chart,
    ChartGroup,
    ChartPair,
    Column,
    PageSection,
    Paragraph,
    SectionPart,
    Table,
    embedded,
    join_sections,
    json_data,
)
from hobble.report.sections import TURN_EDGES
from hobble.report.templates import drawn_by_script, load_template
from hobble.rows.clip_rows import load_clip_rows, save_clip_rows


def chart(name: str) -> Chart:
    return Chart(name, name.title(), "", [{"type": "bar", "y": [1]}])


def test_sections_are_joined_escaped_and_their_charts_and_long_tables_found() -> None:
    rows = [[f"clip {i}", i / 3] for i in range(11)]
    columns = [Column("clip"), Column.number("error")]
    guest = PageSection("errors", [SectionPart(20, chart("b"), tall=True), SectionPart(5, None)])
    parts = [SectionPart(30, Table("long", columns, rows)), SectionPart(10, Paragraph("<b>"))]
    owner = PageSection("errors", parts, title="<S>", order=10, nav="E", long=True)
    pair, family = ChartPair([chart("a"), None]), ChartGroup("f", "F", "", [chart("c"), chart("d")])
    alone = PageSection("laps", [SectionPart(0, pair), SectionPart(1, family)], order=5)
    short = PageSection("laps", [SectionPart(2, Table("short", columns, rows[:10]))])
    nothing = PageSection("none", [SectionPart(0, None)], title="None")
    first, second = joined = join_sections([guest, nothing, owner, alone, short])
    assert (first.name, first.title, first.nav) == ("laps", "Laps", "Laps")
    assert (second.title, second.nav, second.order, second.long) == ("<S>", "E", 10, True)
    assert [part.content.kind for part in second.parts if part.content] == ["words", "chart", "table"]
    drawn = drawn_by_script(joined)
    assert set(drawn["charts"]) == set("abcd")
    assert list(drawn["tables"]) == ["long"]
    assert drawn["tables"]["long"][1] == ["clip 1", ["0.3333333333333333", "0.333"]]
    text = load_template("sections.html.j2").render(sections=joined)
    assert "<p>&lt;b&gt;</p>" in text
    assert "<h2>&lt;S&gt;</h2>" in text
    assert text.count("<figure") == 3
    assert 'class="plot tall" tabindex="0" data-chart="b"' in text


@settings(max_examples=80, deadline=None)
@given(st.dictionaries(st.text(), st.text() | st.floats(allow_nan=False, allow_infinity=False), max_size=4))
def test_embedded_json_comes_back_and_cannot_end_its_element(value: dict) -> None:
    text = str(embedded(value))
    assert json.loads(text) == value
    assert not set("<>&") & set(text)
    assert json_data({"a": np.array([1.0, np.nan]), "b": np.float32("inf")}) == {"a": [1.0, None], "b": None}


def test_texts_are_escaped_for_plotly() -> None:
    chart = Chart("c", "t", "", [{"type": "bar", "y": ["<b>a & b"], "hovertemplate": "%{y}<extra></extra>"}])
    (trace,) = chart.spec()["traces"]
    assert trace["y"] == ["&lt;b>a &amp; b"]
    assert trace["hovertemplate"] == "%{y}<extra></extra>"


def test_a_file_that_holds_no_weights_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "weights.npz"
    path.write_bytes(b"nothing")
    with pytest.raises(InputError, match="damaged or not an npz file"):
        describe_network(path)


def test_turns_speeds_and_severities_are_counted_in_seconds(
    material: ReportMaterial, network: Network, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of many clips some are counted; then the seconds are an estimate for all, and the charts say so."""
    rows = load_clip_rows(material.row_files[0])
    y, severity = np.array(rows.y), np.zeros_like(rows.channels["injury"])
    y[:, rows.layout.y_root_velocity] = [0.0, 2.05]  # 1.23 m/s
    y[:, rows.layout.y_turn] = np.radians(-30.0) / 60  # the world turns right, the figure left
    knee = network.channels["injury"].index("LeftUpLeg-LeftLeg")
    severity[: len(rows) // 2, knee] = 7.2
    save_clip_rows(tmp_path / "walk.npz", replace(rows, y=y, channels={**rows.channels, "injury": severity}))
    found = sections.seconds_of_data([str(tmp_path / "walk.npz")], {rows.clip: "held_out"})
    seconds, hurt = len(np.unique(rows.frame)) / 60, len(np.unique(rows.frame[: len(rows) // 2])) / 60
    of_split = found["both"]["held_out"]
    row, column = np.argwhere(of_split > 0)[0]
    assert of_split[row, column] == of_split.sum() == pytest.approx(seconds)
    middles = sections._middles(TURN_EDGES), sections._middles(sections.SPEED_EDGES)
    assert (middles[0][row], middles[1][column]) == (30.0, 1.3)
    assert not found["both"]["train"].any()
    of_knee = found["channels"]["injury"]["LeftUpLeg-LeftLeg"]
    assert of_knee[6] == of_knee.sum() == pytest.approx(hurt, abs=0.1)
    assert found["estimate"] == ""

    paths = [str(tmp_path / f"walk-{i}.npz") for i in range(8)]
    for path in paths:
        shutil.copy(tmp_path / "walk.npz", path)
    monkeypatch.setattr(sections, "MOST_COUNTED", 4)
    few = sections.seconds_of_data(paths, {})
    np.testing.assert_allclose(few["both"]["train"], 8 * of_split)
    assert few["estimate"] == " Estimated from 4 of 8 clips."
    assert sections.some_files(paths, 4) != paths[:4]


def test_fits_of_uneven_ground_are_listed_with_the_farthest_feet_first(tmp_path: Path) -> None:
    for name, fits, distance in (("near", 10, 0.1), ("far", 10, 0.4), ("flat", 1, 0.0)):
        feet = np.full((2, fits, 2), distance) * [1, 2]
        error = np.arange(2.0 * fits).reshape(2, fits)
        np.savez(tmp_path / f"{name}.npz", error=error, foot_error=feet)
    table = sections.fit_table(sorted(tmp_path.glob("*.npz")))
    assert [row[0] for row in table.rows] == ["far", "near"]
    assert table.rows[0][1:] == pytest.approx([2, 0.4, 0.8, 5.0, 14.0])
    np.savez(tmp_path / "near.npz", frame=np.arange(3))
    with pytest.raises(InputError, match=r"near\.npz: holds no array 'foot_error'"):
        sections.fit_table([tmp_path / "near.npz"])


def test_retargeted_clips_that_differ_most_come_first(material: ReportMaterial) -> None:
    def figures(knee: float, thigh: float) -> dict:
        return {"angles": {"left knee": {"apart": knee}}, "directions": {"right thigh": thigh}}

    differences = (None, figures(2.0, 1.0), figures(3.0, 9.5))
    reports = [{**report, "retarget": d} for report, d in zip(material.motion, differences, strict=False)]
    table = sections.clip_table(replace(material, motion=reports))
    assert [row[-2:] for row in table.rows] == [[9.5, "right thigh"], [2.0, "left knee"], [None, None]]


# Hints


def changed(material: ReportMaterial, **changes: Any) -> ReportMaterial:
    """The material with other measurements, or with other fields."""
    fields = {key: value for key, value in changes.items() if hasattr(material, key)}
    found = {key: value for key, value in changes.items() if key not in fields}
    return replace(material, measurements={**material.measurements, **found}, **fields)


REMEDY = re.compile(r"\b(add|check|expect|keep|list|look|measure|more passes|see|train|try)\b", re.IGNORECASE)


def heads(material: ReportMaterial, **changes: Any) -> dict[str, str]:
    """Title of each hint -> its kind, in order. Every hint about a fault says what to do."""
    found = hints(changed(material, **changes))
    assert [hint for hint in found if hint.kind in ("warn", "note") and not REMEDY.search(hint.text)] == []
    return {hint.head: hint.kind for hint in found}


def history(losses: list[float]) -> dict[str, list[float | None]]:
    n = len(losses)
    return {
        "pass": [1.0 + i // 2 for i in range(n)],
        "section": [1.0 + i % 2 for i in range(n)],
        "train_mse": list(losses),
        "held_out_mse": list(losses),
    }


@pytest.mark.parametrize(
    ("held_out", "kind", "words"),
    [(0.1, "warn", "2.5 times the"), (0.041, "good", "does not overfit"), (0.052, "fact", "1.30 times")],
)
def test_the_gap_to_held_out_clips_gives_the_right_hint(
    material: ReportMaterial, held_out: float, kind: str, words: str
) -> None:
    accuracy = material.measurements["accuracy"]
    accuracy = {**accuracy, "train": {"mean": 0.04}, "held_out": {"mean": held_out}}
    found = heads(material, accuracy=accuracy)
    assert [k for head, k in found.items() if words in head] == [kind]


def test_a_rising_falling_or_flat_curve_gives_the_right_hint(material: ReportMaterial) -> None:
    rising = history([1.0, 0.5, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8])
    assert "The held-out error was lowest in pass 2 and has risen since." in heads(material, history=rising)
    constant = {"configuration": {"training": {"schedule": "constant"}}}
    falling = history([1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3])
    found = heads(material, history=falling, resolved=constant)
    assert any("still fell by 36 %" in head for head in found)
    flat = heads(material, history=history([0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.28, 0.32]), resolved=constant)
    assert flat["The held-out error has stopped falling."] == "good"
    with_the_rate = {"configuration": {"training": {"schedule": "cosine"}}}
    found = heads(material, history=falling, resolved=with_the_rate)
    assert not any("still fell" in head or "stopped falling" in head for head in found)


def test_missed_waypoints_flips_and_ineffective_links_are_reported(material: ReportMaterial) -> None:
    missed = {"waypoints": 114, "waypoints_reached": 113, "largest_turn_degrees": 175.0}
    found = heads(material, responsivity={**material.measurements["responsivity"], **missed})
    assert found["The character reached 113 of 114 waypoints."] == "warn"
    assert found["A joint turned by 175 degrees in one frame."] == "warn"
    deaf = {"applies": True, "responses": [swept("a-b", True, 0.1, 0.0)]}
    assert "1 of 1 hurt links hardly change the walk at severity 10" in heads(material, injury=deaf)


def swept(link: str, trained: bool, pose: float, left: float, rho: float = 1.0) -> dict[str, Any]:
    measures = {"from_healthy_cm": pose, "after_healing_cm": left, "spearman": {"from_healthy": rho}}
    return {"gait": "walk", "link": link, "trained": trained, **measures}


def test_links_never_hurt_in_training_only_show_the_drift_of_the_walk(material: ReportMaterial) -> None:
    drift = swept("never", False, 10.0, 7.0)
    found = heads(material, injury={"responses": [drift, swept("hurt", True, 11.0, 6.5, 0.3)]})
    assert found["Even a healthy walk changes, by 10.0 cm per joint."] == "warn"
    assert "1 of 1 hurt links hardly change the walk at severity 10" in found
    assert not [head for head in found if "does not recover" in head]
    caught = {"responses": [swept("never", False, 0.1, 0.1), swept("hurt", True, 11.0, 6.5)]}
    found = heads(material, injury=caught)
    assert "The walk does not recover after these links have healed: hurt." in found
    assert found["1 of 2 links were hurt in training."] == "good"


def test_the_time_of_a_frame_is_a_median(material: ReportMaterial) -> None:
    times = {"predict": 0.17, "total": 0.17, "spread": {"median": 0.025, "p99": 0.163}}
    responsivity = {**material.measurements["responsivity"], "milliseconds": times}
    slow = changed(material, name="holden", responsivity=responsivity)
    figure = next(f for f in key_figures(slow) if f.label == "Time per frame")
    assert (figure.value, figure.unit) == ("0.025", "ms")
    assert "667 characters" in figure.note
    assert "mean 0.17 ms, published mean 0.376 ms" in figure.note


def test_missing_data_comes_before_longer_training(material: ReportMaterial) -> None:
    """If nobody stands in the clips and the error still falls, the hint on the clips comes first."""
    bare = replace(material, measurements={}, pipeline={}, history={}, motion=[], labels=[], channels=[])
    assert [f.label for f in key_figures(bare)] == ["Network"]
    assert list(heads(bare)) == ["No clips were held out."]
    labels = [{"clip": "a", "seconds": {"walk": 30.0}, "curves": {}}]
    falling = history([0.5 * 0.9**k for k in range(20)])
    found = list(heads(material, labels=labels, history=falling, resolved={}))
    missing = next(k for k, head in enumerate(found) if head.startswith("Nobody stands"))
    assert missing < next(k for k, head in enumerate(found) if "still fell" in head)


def test_clips_without_turns_are_reported(material: ReportMaterial) -> None:
    """A hundred seconds straight on, and some that turn by 50 degrees a second."""
    middles = (TURN_EDGES[:-1] + TURN_EDGES[1:]) / 2

    def said(seconds: float) -> bool:
        straight = np.where(np.abs(middles) < 20, 50.0, 0.0)
        turns = {"train": straight[:, None], "held_out": np.where(middles == 50, seconds, 0.0)[:, None]}
        return any("Hardly anybody turns" in hint.head for hint in hints(material, turns))

    assert [said(seconds) for seconds in (0.0, 0.9, 1.5)] == [True, True, False]


def test_the_page_opens_with_the_injury_that_limps_most() -> None:
    parts = {"columns": ["hip-knee", "back-neck"], "regions": [1], "sliders": {"left thigh": 0, "back": 1}}

    def limps(thigh: float, back: float, gait: str = "walk") -> dict[str, Any]:
        """The limps of both parts at severities 10 and 3."""
        return {
            "sizes": [
                {"gait": gait, "link": link, "stance": share * stance, "step_hurt": 1.0, "knee_hurt": None}
                for share in (1.0, 0.3)
                for link, stance in (("hip-knee", thigh), ("back-neck", back))
            ]
        }

    for measurements, part in (
        ([limps(0.15, 0.01)], "left thigh"),
        ([limps(0.01, -0.15), {}], "back"),
        ([limps(0.01, 0.15, gait="jog")], "left thigh"),
    ):
        assert opening_slider({"channels": [parts]}, measurements) == {"part": part, "value": 7}
    assert opening_slider({"channels": []}, []) == {"part": None, "value": 0}
