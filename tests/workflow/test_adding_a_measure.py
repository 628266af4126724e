"""A new measurement needs two files, and no existing file changes."""

from __future__ import annotations

import csv
import json

import pytest

pytestmark = pytest.mark.workflow

HIPS = '''"""How high the hips of the captured figure are."""

from hobble.core.section import Positive, Section
from hobble.measures.compare import ComparisonAddition
from hobble.measures.measure import Cost, Measure
from hobble.report.parts import Column, Hint, KeyFigure, OverviewColumn, Table
from hobble.report.parts import PageSection, Paragraph, SectionPart


class Options(Section):
    """Its keys of the section `evaluation`."""

    every: Positive = 1


MEASURE = Measure(
    name="hips",
    module=__name__,
    inputs=("clips", "skeleton", "accuracy"),
    options=Options,
    cost=Cost(mb_per_1000_frames=10, least_minutes=1),
)


def section(found, material):
    rows = [[row["clip"], row["highest"]] for row in found["clips"]]
    table = Table("hips", [Column("clip"), Column.number("highest, cm")], rows)
    parts = [SectionPart(10, table), SectionPart(0, Paragraph("How high <they> are."))]
    return PageSection("hips", parts, title="Hips", order=15)


def figures(found, material):
    yield KeyFigure("Highest hips", f"{max(row['highest'] for row in found['clips']):.1f}", "cm", order=35)


def hints(found, material):
    yield Hint("note", "The hips were looked at.", f"In {len(found['clips'])} clips.")


def compared(all_measured, published):
    highest = {m.name: max(row["highest"] for row in m.results_of("hips")["clips"]) for m in all_measured}
    return ComparisonAddition([{"configuration": name, "highest": value} for name, value in highest.items()])


def tables(compared):
    return {"hips": compared["hips"]}


def compared_columns(compared):
    values = {entry["configuration"]: entry["highest"] for entry in compared["hips"]}
    yield OverviewColumn(25, Column.number("highest hips, cm", 4), values)


def compared_section(compared):
    return PageSection("hips", [SectionPart(0, Paragraph("Hips of all."))], order=15)
'''
RUN = """from hobble.measures.measure import MeasureInputs, Outcome
from hobble.rows.clip_rows import captured_stretches
from hobble.rows.clip_rows import load_clip_rows


def run(inputs: MeasureInputs, options) -> Outcome:
    joint = list(inputs.skeleton["joints"]).index(inputs.skeleton["roles"]["hips"])
    rows = []
    for clip, path in inputs.clips.items():
        parts = captured_stretches(load_clip_rows(path))
        heights = [h for part in parts for h in part.local[:: options.every, joint, 1]]
        rows.append({"clip": clip, "frames": len(heights), "highest": round(float(max(heights)), 3)})
    known = [entry["clip"] for entry in inputs.results_of("accuracy")["clips"]]
    return Outcome({"every": options.every, "clips": rows, "known": known}, {"clips": rows}, "<hips>")
"""


@pytest.fixture
def measured(copied):
    """The finished run with a new measurement, which takes two files and a key of the configuration."""
    folder = copied.own_source() / "measures"
    (folder / "hips.py").write_text(HIPS)
    (folder / "hips_run.py").write_text(RUN)
    copied.edit("config/test.yaml", "evaluation:", "evaluation:\n  every: 2")
    return copied


def test_a_new_measurement_is_run_and_nothing_else_is_measured_again(measured) -> None:
    assert measured.planned("results/test/report.html") == {
        "measure": 1, "configuration": 1, "pipeline_summary": 1, "report": 1,
    }  # fmt: skip
    measured.run("-c2", "results/test/evaluation/hips.json")
    results = measured.folder / "results/test"
    found = json.loads((results / "evaluation/hips.json").read_text())
    assert found["every"] == 2
    assert sorted(row["clip"] for row in found["clips"]) == found["known"]
    assert all(70 < row["highest"] < 110 for row in found["clips"])
    with open(results / "evaluation/hips/clips.csv", newline="") as file:
        assert sorted(row["clip"] for row in csv.DictReader(file)) == found["known"]
    assert "<hips>" in (results / "logs/evaluation/hips.log").read_text()


@pytest.mark.slow
def test_a_new_measurement_is_shown_and_compared(measured) -> None:
    measured.run("-c2", "results/test/report.html", "results/compare/report.html", "--config", "compare=test")
    results = measured.folder / "results/test"
    found = json.loads((results / "evaluation/hips.json").read_text())
    stages = json.loads((results / "pipeline.json").read_text())["stages"]
    evaluation = next(stage for stage in stages if stage["stage"] == "evaluation")
    assert "hips" in [rule["rule"] for rule in evaluation["rules"]]
    assert "every: 2" in (results / "configuration.yaml").read_text()
    highest = max(row["highest"] for row in found["clips"])
    page = (results / "report.html").read_text()
    assert page.index('<section id="accuracy"') < page.index('<section id="hips">')
    assert "How high &lt;they&gt; are." in page
    assert f'<dd class="value">{highest:.1f}<small>cm</small>' in page
    assert "The hips were looked at." in page
    compared = measured.folder / "results/compare"
    assert json.loads((compared / "compare.json").read_text())["hips"][0]["highest"] == highest
    assert (compared / "tables/hips.csv").read_text().splitlines()[0] == "configuration,highest"
    page = (compared / "report.html").read_text()
    assert '<a href="#hips">Hips</a>' in page
    assert "highest hips, cm" in page
