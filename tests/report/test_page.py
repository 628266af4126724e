from __future__ import annotations

import base64
import json
import re
import zlib
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from hobble.core.skeleton import Skeleton
from hobble.report import templates
from hobble.report.gather import ReportMaterial, gather
from hobble.report.page import render_report

SECTIONS = [
    "play",
    "gallery",
    "engine",
    "summary",
    "walking",
    "accuracy",
    "injury",
    "speed",
    "training",
    "data",
    "terrain",
    "costs",
    "configuration",
    "origin",
]


class Outline(HTMLParser):
    """Elements with their attributes, and the text of each script."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        self._script = False
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag == "script":
            self.scripts.append("")
        self._script = tag == "script"

    def handle_data(self, data: str) -> None:
        if self._script:
            self.scripts[-1] += data

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture(scope="module")
def outline(page: str) -> Outline:
    return Outline(page)


def data_of(outline: Outline) -> dict[str, Any]:
    """The data of the page, by part."""
    out = {}
    for text, element in zip(outline.scripts, outline.all("script"), strict=True):
        if element.get("type") == "application/zlib":
            text = zlib.decompress(base64.b64decode(text)).decode()
        if "id" in element:
            out[element["id"].removeprefix("data-")] = json.loads(text)
    return out


def test_the_page_has_every_section_and_links_to_it(outline: Outline) -> None:
    ids = [e["id"] for e in outline.all("section")]
    assert ids == SECTIONS
    links = {e["href"] for e in outline.all("a")}
    assert {f"#{i}" for i in ids} - links == {"#gallery", "#engine"}


def test_the_page_loads_nothing_from_elsewhere(page: str, outline: Outline) -> None:
    assert len(page.encode()) < 10e6
    assert len(outline.elements) < 6000
    for tag, attributes in outline.elements:
        assert "src" not in attributes, tag
        assert not (attributes.get("href") or "").startswith(("http", "//", "file"))
    assert [e["href"] for e in outline.all("link")] == ["data:,"]
    (policy,) = [e["content"] for e in outline.all("meta") if e.get("http-equiv")]
    assert (policy or "").startswith("default-src 'none'")
    assert "unsafe-inline" not in (policy or "")
    for kind, directive in (("script", "script-src"), ("style", "style-src")):
        allowed = (policy or "").partition(f"{directive} ")[2].partition(";")[0]
        (text,) = re.findall(f"<{kind}>(.*?)</{kind}>", page, re.DOTALL)
        assert allowed.startswith(templates.hash_source(text))
    assert not [attributes for _, attributes in outline.elements if "style" in attributes]
    own = "".join(p.read_text() for p in templates.FOLDER.glob("web/*.js"))
    assert not re.search(r"fetch\(|XMLHttpRequest|import\(|WebSocket|sendBeacon", own)


def test_every_chart_has_its_data_and_a_label(outline: Outline) -> None:
    charts = data_of(outline)["charts"]
    drawn = [e for e in outline.all("div") if "data-chart" in e]
    assert {e["data-chart"] for e in drawn} == set(charts)
    assert len(drawn) == len(charts) >= 12
    assert all(e["aria-label"] for e in drawn)


def test_ids_are_unique_and_controls_are_labelled(outline: Outline) -> None:
    ids = [a["id"] for _, a in outline.elements if "id" in a]
    assert len(ids) == len(set(ids))
    labels = {e["for"] for e in outline.all("label")}
    assert all(e["id"] in labels for e in outline.all("select"))
    assert labels <= set(ids)


def test_equal_inputs_give_equal_pages(
    material: ReportMaterial,
    play: dict[str, Any],
    character: dict[str, Any],
    compared: dict[str, Any],
    script: str,
    hero: dict[str, Any],
    page: str,
) -> None:
    again = render_report(material, play, character, compared, script, hero)
    commit = re.compile(r'<td class="hash">[0-9a-f]{40}[^<]*</td>')  # of a checkout that others may work in
    assert commit.sub("", again) == commit.sub("", page)


HOSTILE = "<script>alert(1)</script><img src=x onerror=alert(2)>\"'&{{7*7}}"


def test_a_hostile_clip_name_is_only_text(
    examples: ModuleType, holden31: Skeleton, tmp_path: Path, outline: Outline
) -> None:
    clips = (HOSTILE, *examples.CLIPS[1:])
    arguments = examples.write_all(
        tmp_path, holden31, clips, terrain_names=[f"c{i}" for i in range(len(clips))]
    )
    material = gather(**{**arguments, "title": HOSTILE, "dataset": HOSTILE})
    text = render_report(material)
    hostile = Outline(text)
    assert len(hostile.all("script")) == len(outline.all("script"))
    assert not hostile.all("img")
    assert not any(key.startswith("on") for _, a in hostile.elements for key in a)
    assert "{{7*7}}" in text


def test_a_network_without_injuries_has_a_page(
    examples: ModuleType, holden31: Skeleton, tmp_path: Path
) -> None:
    text = render_report(gather(**examples.write_all(tmp_path, holden31, injury=False)))
    assert 'id="injury"' not in text
    assert "Injury response" not in text
    assert 'data-chart="sweep-pose"' not in text
    assert 'id="walking"' not in text
    assert 'id="play"' not in text


def test_our_scripts_cannot_end_their_element(material: ReportMaterial) -> None:
    with pytest.raises(ValueError, match="bundle"):
        render_report(material, bundle="'</SCRIPT>'")
