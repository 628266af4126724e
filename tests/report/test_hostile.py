"""Markup in names and messages has no effect in the page, in a real browser."""

from __future__ import annotations

import json
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from hobble.core.files import CHECKSUMS, load_npz, save_npz
from hobble.core.skeleton import Skeleton
from hobble.models.load import load_network
from hobble.report.character import playable_data
from hobble.report.gather import gather
from hobble.report.page import render_report
from hobble.report.recorded_motion import packed_comparisons, packed_scenes

HOSTILE = (
    "<script>pwned=1</script></script></style><img src=x onerror=pwned=2>\"'`&amp;{{7*7}}${pwned=3}"
    '<a href="javascript:pwned=4">x</a><svg onload=pwned=5><!--]]>'
)
LINK, SENTENCE = "LeftUpLeg-LeftLeg", "frames 2331-2335: the root jumps by 212 cm; the clip ends before."


@pytest.fixture(scope="module")
def hostile(
    examples: ModuleType,
    tools: ModuleType,
    holden31: Skeleton,
    script: str,
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[Any]:
    """The opened page of a data set in which every name is hostile markup."""
    folder = tmp_path_factory.mktemp("hostile")
    clips = (HOSTILE, *examples.CLIPS[1:])
    given = examples.write_all(folder, holden31, clips, terrain_names=[f"c{i}" for i in range(len(clips))])
    for path in folder.rglob("*.json"):
        text = path.read_text()
        for name in (LINK, SENTENCE):
            text = text.replace(json.dumps(name), json.dumps(HOSTILE))
        content = json.loads(text)
        content.pop(CHECKSUMS, None)
        path.write_text(json.dumps(content))
    arrays = dict(load_npz(given["weights"]))
    meta = str(arrays["meta"]).replace(json.dumps(LINK), json.dumps(HOSTILE))
    assert meta != str(arrays["meta"])
    save_npz(given["weights"], **{**arrays, "meta": np.array(meta)})
    material = gather(**{**given, "title": HOSTILE, "dataset": HOSTILE, "name": HOSTILE})
    network = load_network(given["weights"])
    rows = examples.rows(folder / "jog.npz", holden31)
    (folder / "jog.npz").rename(folder / "rows.npz")
    arrays = dict(load_npz(folder / "rows.npz"))
    save_npz(rows, **{**arrays, "clip": np.array(HOSTILE)})
    text = render_report(
        material,
        packed_scenes(folder / "scenarios.npz", material.network["skeleton"]),
        playable_data(network, examples.RUNTIME),
        packed_comparisons(network, [rows], {HOSTILE: "train", "jog": "train"}),
        script,
    )
    yield from tools.opened(text, folder)


@pytest.mark.slow
def test_no_script_in_a_hostile_name_runs(hostile: Any) -> None:
    drawn = "document.querySelector('[data-chart=\"stage-bytes\"] .main-svg') !== null"
    assert hostile.until("typeof Hobble") != "undefined"
    hostile.run("Hobble.drawAll()")
    assert hostile.until(drawn, 60), hostile.console
    # Touch whatever can be touched: choosers, sorting, folds, and what appears under the pointer.
    hostile.run("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    hostile.run("document.querySelectorAll('th button').forEach((b) => b.click())")
    hostile.run(
        "document.querySelectorAll('select').forEach((s) => { s.selectedIndex = s.options.length - 1;"
        " s.dispatchEvent(new Event('change', { bubbles: true })); })"
    )
    hostile.run("new Promise((done) => setTimeout(done, 500))")
    assert hostile.run("typeof pwned") == "undefined"
    assert (
        hostile.run("document.querySelectorAll('img[src=x], [onerror], [onload], svg svg[onload]').length")
        == 0
    )
    assert hostile.run("document.querySelectorAll('a[href^=\"javascript\"]').length") == 0
    assert not [url for url in hostile.requests if not url.startswith(("file:", "data:", "blob:"))]


def test_hostile_names_are_shown_as_text(hostile: Any) -> None:
    for place in ("h1", "#data td", "#play-sliders, #injury, #walking"):
        shown = f"[...document.querySelectorAll({json.dumps(place)})].some((e) => e.textContent.includes(%s))"
        assert hostile.run(shown % json.dumps(HOSTILE)), place
    assert hostile.run(f"document.title.includes({json.dumps(HOSTILE)})")
