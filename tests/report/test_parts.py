"""Sections that several measurements share, and their charts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from hobble.measures.registry import MEASURES
from hobble.report import measured
from hobble.report.charts import Chart, Family
from hobble.report.parts import Pair, Part, Section, Words, joined
from hobble.report.tables import Column, Table
from hobble.report.templates import specs, template


def chart(name: str) -> Chart:
    return Chart(name, name.title(), "", [{"type": "bar", "y": [1]}])


def test_sections_of_one_name_are_one_with_the_parts_of_all_in_their_order() -> None:
    table = Table("t", [Column("a")], [["x"]])
    guest = Section("errors", [Part(20, chart("b")), Part(5, None)])
    owner = Section(
        "errors", [Part(30, table), Part(10, Words("w"))], title="Errors", at=10, nav="E", long=True
    )
    alone = Section("laps", [Part(0, chart("c"))], at=5)
    nothing = Section("none", [Part(0, None)], title="None")
    first, second = joined([guest, nothing, owner, alone])
    assert (first.name, first.title, first.nav) == ("laps", "Laps", "Laps")
    assert (second.title, second.nav, second.at, second.long) == ("Errors", "E", 10, True)
    assert [part.kind for part in second.parts] == ["words", "chart", "table"]


def test_a_pair_without_charts_is_nothing() -> None:
    assert joined([Section("s", [Part(0, Pair([None, None])), Part(5, None)], title="S")]) == []
    [shown] = joined([Section("s", [Part(0, Pair([None, chart("a")]))])])
    assert [part.kind for part in shown.parts] == ["pair"]


@pytest.mark.parametrize("found", [{}, {"applies": False, "reason": "no such input"}])
def test_a_measurement_that_found_nothing_leaves_no_section(found: dict[str, Any], material: Any) -> None:
    nothing = replace(material, measured={one.name: found for one in MEASURES})
    assert measured.sections(material) != []
    assert measured.sections(nothing) == []


def test_charts_are_found_wherever_they_stand() -> None:
    pair, family = Pair([chart("a"), None]), Family("f", "F", "", [chart("b"), chart("c")])
    section = Section("s", [Part(0, pair), Part(1, family), Part(2, Words("w")), Part(3, chart("d"))])
    assert set(specs([{"x": {"y": chart("e"), "z": None}}, [section]])) == set("abcde")


def test_words_are_escaped_and_every_kind_is_drawn() -> None:
    parts = [
        Part(0, Words("<b>")),
        Part(1, Pair([chart("a"), None])),
        Part(2, chart("b"), tall=True),
    ]
    section = joined([Section("s", parts, title="<S>")])
    text = template("measured.html.j2").render(measured=section)
    assert "<p>&lt;b&gt;</p>" in text
    assert "<h2>&lt;S&gt;</h2>" in text
    assert text.count("<figure") == 2
    assert 'class="plot tall" tabindex="0" data-chart="b"' in text
