"""The page as HTML: its parts, its policy, and markup in names, which has no effect."""

import base64
import json
import re
import zlib
from dataclasses import fields, replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from hobble.core.errors import HobbleError
from hobble.measures.measure import all_measures
from hobble.models.network import Network
from hobble.report import sections, templates
from hobble.report.bundle import bundle_page_scripts, install_npm_packages
from hobble.report.character import packed_comparisons
from hobble.report.gather import ReportMaterial
from hobble.report.page import render_report
from hobble.report.parts import embedded
from tests.report.browser import Browser, opened
from tests.report.conftest import CLIP

SECTIONS = {
    *("play", "gallery", "engine", "summary", "accuracy", "injury", "speed", "training", "data", "terrain"),
    *("costs", "configuration", "origin"),
}


class Outline(HTMLParser):
    """Elements with their attributes, and the text of each script under the key "text"."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        if self.elements and self.elements[-1][0] == "script":
            self.elements[-1][1].setdefault("text", data)

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture(scope="module")
def outline(page: str) -> Outline:
    return Outline(page)


def test_every_section_is_linked_and_every_chart_control_and_id_is_in_order(outline: Outline) -> None:
    sections = {e["id"] for e in outline.all("section")}
    assert sections > SECTIONS
    assert {f"#{i}" for i in sections} - {e["href"] for e in outline.all("a")} == {"#gallery", "#engine"}
    ids = [a["id"] for _, a in outline.elements if "id" in a]
    assert len(ids) == len(set(ids))
    labels = {e["for"] for e in outline.all("label")}
    assert all(e["id"] in labels for e in outline.all("select"))
    assert labels <= set(ids)
    (packed,) = [e["text"] for e in outline.all("script") if e.get("id") == "data-charts"]
    charts = json.loads(zlib.decompress(base64.b64decode(packed or "")))
    drawn = [e for e in outline.all("div") if "data-chart" in e]
    assert {e["data-chart"] for e in drawn} == set(charts)
    assert len(drawn) == len(charts) >= 12
    assert all(e["aria-label"] for e in drawn)


def test_the_page_is_small_and_loads_nothing_from_elsewhere(page: str, outline: Outline) -> None:
    assert len(page.encode()) < 10e6
    assert len(outline.elements) < 6000
    for tag, attributes in outline.elements:
        assert "src" not in attributes, tag
        assert "style" not in attributes, tag
        assert not (attributes.get("href") or "").startswith(("http", "//", "file"))
    (policy,) = [e["content"] or "" for e in outline.all("meta") if e.get("http-equiv")]
    assert policy.startswith("default-src 'none'")
    assert "unsafe-inline" not in policy
    for kind, directive in (("script", "script-src"), ("style", "style-src")):
        allowed = policy.partition(f"{directive} ")[2].partition(";")[0]
        (text,) = re.findall(f"<{kind}>(.*?)</{kind}>", page, re.DOTALL)
        assert allowed.startswith(templates.hash_source(text))
    own = "".join(p.read_text() for p in templates.FOLDER.glob("web/*.js"))
    assert not re.search(r"fetch\(|XMLHttpRequest|import\(|WebSocket|sendBeacon", own)


def test_a_network_without_channels_has_a_page_and_measurements_without_results_no_section(
    material: ReportMaterial,
) -> None:
    nothing = {one.name: {"applies": False, "reason": "no such input"} for one in all_measures()}
    ids = {e["id"] for e in Outline(render_report(replace(material, measurements=nothing))).all("section")}
    assert ids == SECTIONS - {"play", "gallery", "engine", "accuracy", "injury", "speed"}


@pytest.mark.slow
def test_the_page_does_not_grow_with_the_clips(
    material: ReportMaterial, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With smaller limits, so that a test need not make hundreds of clips."""
    monkeypatch.setattr(sections, "MOST_ROWS", 12)
    monkeypatch.setattr(sections, "MOST_REMARKS", 20)

    def size(copies: int) -> int:
        many = {
            key: [{**one, "clip": f"{one['clip']}-{i}"} for i in range(copies) for one in reports]
            for key in ("motion", "labels", "channels")
            if (reports := getattr(material, key))
        }
        return len(render_report(replace(material, **many)))

    assert size(100) < 1.01 * size(20)


HOSTILE = (
    "<script>pwned=1</script></script></style><img src=x onerror=pwned=2>\"'`&amp;{{7*7}}${pwned=3}"
    '<a href="javascript:pwned=4">x</a><svg onload=pwned=5><!--]]>'
)


@pytest.fixture(scope="module")
def hostile(material: ReportMaterial, character: dict[str, Any], network: Network, script: str) -> str:
    """A page in which a clip, a trained link and the data set have a name of markup."""
    link = network.trained_labels("injury")[0]

    def renamed(value: Any) -> Any:
        text = json.dumps(json.loads(embedded(value)))
        for name in (CLIP, link):
            text = text.replace(json.dumps(name), json.dumps(HOSTILE))
        return json.loads(text)

    kept = ("measures", "terrain_files", "row_files")
    changed = {
        f.name: renamed(getattr(material, f.name)) for f in fields(ReportMaterial) if f.name not in kept
    }
    named = dict.fromkeys(("name", "dataset", "title"), HOSTILE)
    compared = renamed(packed_comparisons(network, material.row_files, material.splits))
    page = render_report(
        ReportMaterial(**{**changed, **named, **{key: getattr(material, key) for key in kept}}),
        renamed(character),
        compared,
        script,
    )
    return page


def test_a_hostile_name_is_only_text(hostile: str, outline: Outline) -> None:
    found = Outline(hostile)
    assert len(found.all("script")) == len(outline.all("script"))
    assert not found.all("img")
    assert not any(key.startswith("on") for _, attributes in found.elements for key in attributes)
    assert "{{7*7}}" in hostile


@pytest.mark.slow
def test_no_script_in_a_hostile_name_runs(hostile: str, tmp_path: Path) -> None:
    """Everything is touched: choosers, sorting, folds, charts."""
    tabs = opened(hostile, tmp_path)
    tab: Browser = next(tabs)
    tab.run("location.hash = '#summary'")
    tab.run("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    tab.run("Hobble.drawAll()")
    tab.run("document.querySelectorAll('th button').forEach((b) => b.click())")
    for choice in tab.run(
        "[...document.querySelectorAll('select')].map(({ id, options }) => [id, options.length])"
    ):
        tab.choose(choice[0], choice[1] - 1)
    tab.run("new Promise((done) => setTimeout(done, 500))")
    assert tab.run("typeof pwned") == "undefined"
    bad = 'img[src=x], [onerror], [onload], svg svg[onload], a[href^="javascript"]'
    assert tab.run(f"document.querySelectorAll({json.dumps(bad)}).length") == 0
    assert tab.fetched == []
    for place in ("h1", "#data td"):
        shown = f"[...document.querySelectorAll({json.dumps(place)})].some((e) => e.textContent.includes(%s))"
        assert tab.run(shown % json.dumps(HOSTILE)), place
    assert tab.run(f"document.title.includes({json.dumps(HOSTILE)})")
    next(tabs, None)


def test_a_script_that_is_wrong_is_named(modules: Path, results: Path, tmp_path: Path) -> None:
    (tmp_path / "index.js").write_text("const a = ;")
    with pytest.raises(HobbleError, match=r"index\.js:1"):
        bundle_page_scripts(modules, results / "page/engine.wasm", tmp_path / "out.js", tmp_path)
    assert not (tmp_path / "out.js").exists()


@pytest.mark.slow
def test_without_the_registry_the_message_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("npm_config_registry", "http://127.0.0.1:9/")
    monkeypatch.setenv("npm_config_cache", str(tmp_path / "cache"))
    monkeypatch.setenv("npm_config_fetch_retries", "0")
    with pytest.raises(HobbleError, match=r"could not download .* from the npm registry"):
        install_npm_packages(tmp_path / "page")
