"""What stands in the sections: seconds of data, hints, and the injury that the page opens with."""

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

from hobble.models.network import Network
from hobble.report import sections
from hobble.report.character import opening_slider
from hobble.report.gather import ReportMaterial
from hobble.report.page import hints
from hobble.report.parts import Chart, embedded
from hobble.report.sections import TURN_EDGES
from hobble.rows.clip_rows import load_clip_rows, save_clip_rows


@settings(max_examples=80, deadline=None)
@given(st.dictionaries(st.text(), st.text() | st.floats(allow_nan=False, allow_infinity=False), max_size=4))
def test_embedded_json_comes_back_and_cannot_end_its_element(value: dict) -> None:
    text = str(embedded(value))
    assert json.loads(text) == value
    assert not set("<>&") & set(text)
    numbers = {"a": np.array([1.0, np.nan]), "b": np.float32("inf")}
    assert json.loads(embedded(numbers)) == {"a": [1.0, None], "b": None}
    texts = Chart("c", "t", "", [{"y": ["<b>a & b"], "hovertemplate": "%{y}<extra></extra>"}])
    (trace,) = texts.spec()["options"][0]["traces"]
    assert trace == {"y": ["&lt;b>a &amp; b"], "hovertemplate": "%{y}<extra></extra>"}, "plotly reads HTML"


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
    monkeypatch.setattr(sections, "MOST_COUNTED", 4)
    paths = [str(shutil.copy(tmp_path / "walk.npz", tmp_path / f"walk-{i}.npz")) for i in range(8)]
    few = sections.seconds_of_data(paths, {})
    np.testing.assert_allclose(few["both"]["train"], 8 * of_split)
    assert few["estimate"] == " Estimated from 4 of 8 clips."


# Hints

REMEDY = re.compile(r"\b(add|check|expect|keep|list|look|measure|more passes|see|train|try)\b", re.IGNORECASE)


def changed(material: ReportMaterial, **changes: Any) -> ReportMaterial:
    """The material with other measurements, or with other fields."""
    fields = {key: value for key, value in changes.items() if hasattr(material, key)}
    found = {
        key: {**material.results_of(key), **value} for key, value in changes.items() if key not in fields
    }
    return replace(material, measurements={**material.measurements, **found}, **fields)


def history(*losses: float) -> dict[str, Any]:
    """Two values for each pass."""
    passes = [1.0 + i // 2 for i in range(len(losses))]
    sections = [1.0 + i % 2 for i in range(len(losses))]
    return {"pass": passes, "section": sections, "train_mse": [*losses], "held_out_mse": [*losses]}


def trained(schedule: str) -> dict[str, Any]:
    return {"configuration": {"training": {"schedule": schedule}}}


def swept(link: str, trained: bool, pose: float, left: float) -> dict[str, Any]:
    measures = {"from_healthy_cm": pose, "after_healing_cm": left, "spearman": {"from_healthy": 0.3}}
    return {"gait": "walk", "link": link, "trained": trained, **measures}


FLAT = history(0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.28, 0.32)
FALLING = history(1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3)
DRIFT = swept("never", False, 10.0, 7.0), swept("hurt", True, 11.0, 6.5)
LASTING = swept("never", False, 0.1, 0.1), swept("hurt", True, 11.0, 6.5)
# fmt: off
FINDINGS = [  # changes of the material, what is said with its kind, what is not said
    ({"accuracy": {"train": {"mean": 0.04}, "held_out": {"mean": 0.1}}}, {"2.5 times": "warn"}, "overfit"),
    ({"accuracy": {"train": {"mean": 0.04}, "held_out": {"mean": 0.041}}}, {"not overfit": "good"}, "2.5"),
    ({"history": history(1.0, 0.5, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)}, {"in pass 2 and": "warn"}, "fell"),
    ({"history": FALLING, "resolved": trained("constant")}, {"still fell by 36 %": "note"}, "lowest in pass"),
    ({"history": FLAT, "resolved": trained("constant")}, {"stopped": "good"}, "fell"),
    ({"history": FALLING, "resolved": trained("cosine")}, {}, "fell"),  # because the rate fell
    ({"responsivity": {"waypoints": 114, "waypoints_reached": 113}}, {"113 of 114 waypoints": "warn"}, "°"),
    # Links that were never hurt in training show the drift of a healthy walk.
    ({"injury": {"responses": DRIFT}}, {"changes, by 10.0 cm": "warn", "1 of 1 hurt": "note"}, "recover"),
    ({"injury": {"responses": LASTING}}, {"healed: hurt.": "note", "1 of 2 links": "good"}, "hardly"),
]
# fmt: on


@pytest.mark.parametrize(("changes", "said", "not_said"), FINDINGS)
def test_findings_are_said_with_what_to_do(
    material: ReportMaterial, changes: dict[str, Any], said: dict[str, str], not_said: str
) -> None:
    found = hints(changed(material, **changes))
    for words, kind in said.items():
        assert [hint.kind for hint in found if words in hint.head] == [kind]
    assert not any(not_said in hint.head for hint in found if hint.head not in said)
    assert [hint for hint in found if hint.kind in ("warn", "note") and not REMEDY.search(hint.text)] == []


def test_the_page_opens_with_the_injury_that_limps_most() -> None:
    channel = {"columns": ["hip-knee", "back-neck"], "regions": [1], "sliders": {"left thigh": 0, "back": 1}}
    for thigh, back, gait, part in (
        (0.15, 0.01, "walk", "left thigh"),
        (0.01, -0.15, "walk", "back"),
        (0.01, 0.15, "jog", "left thigh"),
    ):
        sizes = [
            {"gait": gait, "link": link, "stance": share * stance}
            for share in (0.3, 1.0)
            for link, stance in (("hip-knee", thigh), ("back-neck", back))
        ]
        assert opening_slider({"channels": [channel]}, [{}, {"sizes": sizes}]) == {"part": part, "value": 7}
    assert opening_slider({"channels": []}, []) == {"part": None, "value": 0}
