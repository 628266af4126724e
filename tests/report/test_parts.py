"""Sections that several measurements share, and their charts."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.measures.measure import all_measures
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
from hobble.report.templates import drawn_by_script, load_template, measured_by


def chart(name: str) -> Chart:
    return Chart(name, name.title(), "", [{"type": "bar", "y": [1]}])


def test_sections_with_one_name_are_joined_and_their_parts_sorted() -> None:
    table = Table("t", [Column("a")], [["x"]])
    guest = PageSection("errors", [SectionPart(20, chart("b")), SectionPart(5, None)])
    owner = PageSection(
        "errors",
        [SectionPart(30, table), SectionPart(10, Paragraph("w"))],
        title="Errors",
        order=10,
        nav="E",
        long=True,
    )
    alone = PageSection("laps", [SectionPart(0, chart("c"))], order=5)
    nothing = PageSection("none", [SectionPart(0, None)], title="None")
    first, second = join_sections([guest, nothing, owner, alone])
    assert (first.name, first.title, first.nav) == ("laps", "Laps", "Laps")
    assert (second.title, second.nav, second.order, second.long) == ("Errors", "E", 10, True)
    assert [part.content.kind for part in second.parts] == ["words", "chart", "table"]


@pytest.mark.parametrize("found", [{}, {"applies": False, "reason": "no such input"}])
def test_a_measurement_that_found_nothing_leaves_no_section(found: dict[str, Any], material: Any) -> None:
    nothing = replace(material, measurements={one.name: found for one in all_measures()})
    assert join_sections(measured_by(material, "section")) != []
    assert join_sections(measured_by(nothing, "section")) == []


def test_charts_are_found_wherever_they_stand() -> None:
    pair, family = ChartPair([chart("a"), None]), ChartGroup("f", "F", "", [chart("b"), chart("c")])
    section = PageSection(
        "s",
        [
            SectionPart(0, pair),
            SectionPart(1, family),
            SectionPart(2, Paragraph("w")),
            SectionPart(3, chart("d")),
        ],
    )
    rows = [[f"clip {i}", i / 3] for i in range(11)]
    columns = [Column("clip"), Column.number("error")]
    tables = [Table("long", columns, rows), Table("short", columns, rows[:10])]
    drawn = drawn_by_script([{"x": {"y": chart("e"), "z": None}}, [section], tables])
    assert set(drawn["charts"]) == set("abcde")
    assert list(drawn["tables"]) == ["long"]
    assert drawn["tables"]["long"][1] == ["clip 1", ["0.3333333333333333", "0.333"]]


def test_words_are_escaped_and_every_kind_is_drawn() -> None:
    parts = [
        SectionPart(0, Paragraph("<b>")),
        SectionPart(1, ChartPair([chart("a"), None])),
        SectionPart(2, chart("b"), tall=True),
    ]
    section = join_sections([PageSection("s", parts, title="<S>")])
    text = load_template("measurements.html.j2").render(measured_sections=section)
    assert "<p>&lt;b&gt;</p>" in text
    assert "<h2>&lt;S&gt;</h2>" in text
    assert text.count("<figure") == 2
    assert 'class="plot tall" tabindex="0" data-chart="b"' in text


@settings(max_examples=80, deadline=None)
@given(st.dictionaries(st.text(), st.text() | st.floats(allow_nan=False, allow_infinity=False), max_size=4))
def test_embedded_json_comes_back_and_cannot_end_its_element(value: dict) -> None:
    text = str(embedded(value))
    assert json.loads(text) == value
    assert not set("<>&") & set(text)
    assert json_data({"a": np.array([1.0, np.nan]), "b": np.float32("inf")}) == {"a": [1.0, None], "b": None}
