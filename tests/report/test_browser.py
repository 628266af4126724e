"""The page in a real browser: what a reader can do, and what the page does by itself."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest

from hobble.report.gather import ReportMaterial

INK = """(() => {{
  const canvas = document.getElementById("{0}"), copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const context = copy.getContext("2d", {{ willReadFrequently: true }});
  context.drawImage(canvas, 0, 0);
  const pixels = context.getImageData(0, 0, copy.width, copy.height).data;
  let sum = 0;
  for (let i = 3; i < pixels.length; i += 4) sum += pixels[i] > 0;
  return sum / (copy.width * copy.height);
}})()"""


@pytest.fixture(scope="module", autouse=True)
def report(tab: Any) -> None:
    """The report is shown, with all its sections open."""
    tab.run("location.hash = '#summary'")
    tab.run("document.querySelectorAll('.fold').forEach((fold) => { fold.open = true; })")
    assert tab.until("document.documentElement.dataset.part === 'report'")


def show(tab: Any, what: str) -> None:
    """Scroll to an element."""
    tab.run(f"document.getElementById('{what}').scrollIntoView({{ behavior: 'instant', block: 'center' }})")


def choose(tab: Any, what: str, index: int) -> None:
    """Pick an option of a <select>."""
    tab.run(
        f"(() => {{ const s = document.getElementById('{what}'); s.selectedIndex = {index};"
        " s.dispatchEvent(new Event('change')); })()"
    )


def scrub(tab: Any, frame: int) -> None:
    """Drag the figure's slider."""
    tab.run(
        f"(() => {{ const t = document.getElementById('time'); t.value = {frame};"
        " t.dispatchEvent(new Event('input')); })()"
    )


def text(tab: Any, what: str) -> str:
    return tab.run(f"document.getElementById('{what}').textContent")


def test_charts_are_drawn_when_they_are_scrolled_to(tab: Any) -> None:
    last = "document.querySelector('[data-chart=\"stage-bytes\"] .main-svg') !== null"
    show(tab, "costs")
    assert tab.until(last)
    tab.run("Hobble.drawAll()")
    undrawn = (
        "[...document.querySelectorAll('[data-chart]')].filter((e) => !e.querySelector('.main-svg')).length"
    )
    assert tab.run(undrawn) == 0


def test_the_figure_plays_stops_and_is_scrubbed(tab: Any) -> None:
    show(tab, "stage")
    assert tab.until(INK.format("view") + " > .02")
    tab.run("document.getElementById('stage').focus()")
    assert text(tab, "pause") == "Pause"
    tab.press(" ", "Space")
    assert text(tab, "pause") == "Play"
    scrub(tab, 120)
    assert tab.until("document.getElementById('clock').textContent === '6.0 of 9.9 s'")
    tab.press(".", "Period")
    assert tab.until("Number(document.getElementById('time').value) === 121")
    tab.press("n", "KeyN")
    assert tab.run("document.getElementById('scenario').value") == "Jog"


def test_captured_and_predicted_are_drawn_and_stepped_through(tab: Any) -> None:
    show(tab, "compare-stage")
    assert tab.until(INK.format("compare-view") + " > .02")
    assert text(tab, "compare-choice") == "walk_turnsjog"
    tab.run("document.getElementById('compare-stage').focus()")
    for _ in range(3):
        tab.press(".", "Period")
    assert tab.until("Number(document.getElementById('compare-time').value) === 3")
    assert tab.until("document.getElementById('compare-reading').textContent.startsWith('held out')")
    choose(tab, "compare-choice", 1)
    assert tab.until("document.getElementById('compare-reading').textContent.startsWith('a training clip')")


def test_a_point_about_a_clip_opens_it_where_it_is_worst(tab: Any) -> None:
    charts = "[...document.querySelectorAll('[data-chart]')]"
    tab.run("Hobble.drawAll()")
    clicked = f"""{charts}.some((chart) => chart.data?.some((trace) => (trace.y || []).includes("jog")
      && (chart.emit("plotly_click", {{ points: [{{ y: "jog", x: 3 }}] }}), true)))"""
    assert tab.run(clicked)
    assert tab.run("document.getElementById('compare-choice').value") == "jog"
    worst = """(({ error }) => error.indexOf(Math.max(...error)))(
      Hobble.material.compare.clips.find(({ name }) => name === "jog"))"""
    assert tab.until(f"Number(document.getElementById('compare-time').value) === {worst}")
    assert tab.run("Hobble.openClip('none of these')") is False


def test_choosers_change_their_pictures(tab: Any, material: ReportMaterial) -> None:
    choose(tab, "sweeps-choice", 2)
    drawn = "document.querySelector('[data-chart=\"sweep-speed\"]').data[0].y[0]"
    assert tab.run(drawn) == pytest.approx(material.measurements["injury"]["rows"][22]["speed"])


def test_tables_sort_and_become_csv(tab: Any, material: ReportMaterial) -> None:
    table = "document.querySelector('table[data-csv=\"example-accuracy\"]')"
    ranked = [
        row["clip"] for row in sorted(material.measurements["accuracy"]["clips"], key=lambda row: row["mean"])
    ]
    column = f"[...{table}.tBodies[0].rows].map((row) => row.cells[0].textContent)"
    for order, name in ((ranked, "ascending"), (ranked[::-1], "descending")):
        tab.run(f"{table}.tHead.rows[0].cells[3].querySelector('button').click()")
        assert tab.run(column) == order[:10]
        assert tab.run(f"{table}.tHead.rows[0].cells[3].getAttribute('aria-sort')") == name
    lines = tab.run(f"Hobble.csv({table})").split("\r\n")
    assert lines[0] == 'clip,split,frames,mean,sd,"position error, cm"'
    worst = max(material.measurements["accuracy"]["clips"], key=lambda row: row["mean"])
    assert lines[1].startswith(f"{worst['clip']},{worst['split']},{worst['frames']},{worst['mean']},")


def test_a_long_table_shows_ten_rows_and_sorts_all(tab: Any) -> None:
    table = "document.querySelector('table[data-csv=\"example-history\"]')"
    count = f"{table}.tBodies[0].rows.length"
    assert tab.run(count) == 10
    tab.run(f"for (let i = 0; i < 2; i++) {table}.tHead.rows[0].cells[2].querySelector('button').click()")
    assert tab.run(count) == 10
    samples = [float(line.split(",")[2]) for line in tab.run(f"Hobble.csv({table})").split("\r\n")[1:-1]]
    assert float(tab.run(f"{table}.tBodies[0].rows[0].cells[2].textContent").replace(",", "")) == max(samples)
    tab.run("document.querySelector('[data-all=\"example-history\"]').click()")
    assert tab.run(count) == len(samples) > 10


def test_the_page_is_short_until_sections_are_opened(tab: Any) -> None:
    """And a link opens the section that it names."""
    folds = "[...document.querySelectorAll('.fold')]"
    tab.run(f"{folds}.forEach((fold) => {{ fold.open = false; }})")
    assert tab.run("document.documentElement.scrollHeight") < 9000
    tab.run("location.hash = '#costs'")
    assert tab.until(
        f"{folds}.filter((fold) => fold.open).map((fold) => fold.parentElement.id).join() === 'costs'"
    )
    tab.run("location.hash = '#play'")
    assert tab.until("document.getElementById('report').offsetParent === null")
    tab.run("location.hash = '#summary'")
    assert tab.until("document.getElementById('play').offsetParent === null")
    tab.run(f"{folds}.forEach((fold) => {{ fold.open = true; }})")


def test_themes_recolour_page_and_charts(tab: Any) -> None:
    colours = []
    for _ in range(2):
        tab.run("document.getElementById('theme').click()")
        colours.append(
            tab.run(
                "[getComputedStyle(document.body).backgroundColor,"
                " document.querySelector('[data-chart=\"learning-curve\"]').data[1].line.color]"
            )
        )
    assert colours == [["rgb(252, 251, 248)", "rgb(11, 110, 116)"], ["rgb(20, 23, 26)", "rgb(88, 188, 192)"]]
    tab.run("document.getElementById('theme').click()")


@pytest.mark.parametrize("width", [390, 820, 1440])
def test_the_page_fits_its_window(tab: Any, width: int) -> None:
    tab.size(width, 900)
    over = (
        "[...document.querySelectorAll('main *')]"
        ".filter((e) => e.getBoundingClientRect().right > innerWidth + 1"
        " && !e.closest('.table, pre, .plot, svg')).map((e) => e.tagName + '.' + e.className)"
    )
    assert tab.until(f"document.documentElement.scrollWidth <= {width}"), tab.run(over)
    tab.size(1280, 900)


CUT = """(() => [...document.querySelectorAll('[data-chart]')].flatMap((e) => {
  const box = (one) => one.getBoundingClientRect(), whole = box(e);
  const all = [...e.querySelectorAll('.xtick, .ytick, .xtitle, .ytitle, .legendtext')];
  const texts = all.filter((t) => t.textContent);
  const cut = texts.filter((t) => box(t).left < whole.left - 1 || box(t).right > whole.right + 1);
  const on = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  const title = e.querySelector('.ytitle'), bar = e.querySelector('.modebar-container .modebar');
  const over = title ? [...e.querySelectorAll('.ytick text')].filter((t) => on(box(t), box(title))) : [];
  const under = bar ? [...e.querySelectorAll('.legendtext')].filter((t) => on(box(t), box(bar))) : [];
  return [...cut, ...over, ...under].map((t) => e.dataset.chart + ': ' + t.textContent);
}))()"""


@pytest.mark.slow
def test_no_text_of_a_chart_is_cut_or_covered(tab: Any) -> None:
    tab.size(1280, 900)
    tab.run("Hobble.drawAll()")
    assert tab.until(f"{CUT}.length === 0"), tab.run(CUT)


@pytest.mark.slow
def test_axe_finds_no_accessibility_problem(tab: Any, modules: Path) -> None:
    """In a wide and in a narrow window, in light and in dark."""
    for width, theme in itertools.product((1440, 390), ("light", "dark")):
        tab.size(width, 900)
        tab.run(f"document.documentElement.dataset.theme = '{theme}'")
        assert tab.violations(modules) == []
    tab.run("delete document.documentElement.dataset.theme")
    tab.size(1280, 900)


@pytest.mark.slow
def test_every_chart_is_printed_in_light_colours(tab: Any) -> None:
    tab.run("document.querySelectorAll('details').forEach((each) => { each.open = false; })")
    tab.run("dispatchEvent(new Event('beforeprint'))")
    assert tab.run("getComputedStyle(document.body).backgroundColor") == "rgb(252, 251, 248)"
    assert tab.run("document.querySelectorAll('details:not([open])').length") == 0
    assert tab.until("document.querySelector('[data-chart=\"stage-bytes\"] .main-svg') !== null")
    assert tab.run(INK.format("compare-view")) > 0.02
    tab.run("dispatchEvent(new Event('afterprint'))")
    assert len(tab.send("Page.printToPDF")["data"]) > 100_000


def test_the_page_prints_no_console_message_and_makes_no_request(tab: Any) -> None:
    """No console message and no request. Runs last, after all tests above have used the page."""
    assert tab.console == []
    assert [url for url in tab.requests if not url.startswith(("file:", "data:", "blob:", "about:"))] == []
