"""The report in a real browser: what a reader can do, and what the page does by itself."""

import csv
import io
import itertools
from pathlib import Path

import pytest

from hobble.report.gather import ReportMaterial
from tests.report.browser import Browser

INK = """(() => {{
  const canvas = document.getElementById("{0}"), copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const context = copy.getContext("2d", {{ willReadFrequently: true }});
  context.drawImage(canvas, 0, 0);
  const pixels = context.getImageData(0, 0, copy.width, copy.height).data;
  let sum = 0; // pixels that differ from the sky at the left edge
  for (let i = 0; i < pixels.length; i += 4) sum += pixels[i] !== pixels[i - i % (4 * copy.width)];
  return sum / (copy.width * copy.height);
}})()"""
FOLDS = "[...document.querySelectorAll('.fold')]"
DRAWN = "document.querySelector('[data-chart=\"stage-bytes\"] .main-svg') !== null"


@pytest.fixture(scope="module", autouse=True)
def report(tab: Browser) -> None:
    """The report is shown, with all its sections open."""
    tab.size(1280, 900)
    tab.run("location.hash = '#summary'")
    assert tab.until("document.documentElement.dataset.part === 'report'")
    tab.run(f"{FOLDS}.forEach((fold) => {{ fold.open = true; }})")


def show(tab: Browser, what: str) -> None:
    """Scroll to an element."""
    tab.run(f"document.getElementById('{what}').scrollIntoView({{ behavior: 'instant', block: 'center' }})")


def test_charts_are_drawn_when_they_are_scrolled_to(tab: Browser) -> None:
    show(tab, "costs")
    assert tab.until(DRAWN)
    tab.run("Hobble.drawAll()")
    undrawn = (
        "[...document.querySelectorAll('[data-chart]')].filter((e) => !e.querySelector('.main-svg')).length"
    )
    assert tab.run(undrawn) == 0


def test_captured_and_predicted_are_drawn_played_and_stepped_through(tab: Browser) -> None:
    show(tab, "compare-stage")
    assert tab.until(INK.format("compare-view") + " > .02")
    tab.run("document.getElementById('compare-stage').focus()")
    for _ in range(3):
        tab.press(".", "Period")
    time = "Number(document.getElementById('compare-time').value)"
    assert tab.until(f"{time} === 3")
    words = "document.getElementById('compare-reading').textContent"
    assert tab.until(f"{words}.startsWith('held out')")
    tab.press(" ", "Space")
    assert tab.until(f"{time} > 3.5")
    tab.press(" ", "Space")
    tab.choose("compare-choice", tab.run("document.getElementById('compare-choice').options.length") - 1)
    assert tab.until(f"{words}.startsWith('a training clip')")


def test_a_row_about_a_clip_opens_it_where_it_is_worst(tab: Browser, material: ReportMaterial) -> None:
    tab.run("Hobble.drawAll()")
    clip = tab.run("Hobble.material.compare.clips[1].name")
    row = f"[...document.querySelectorAll('tbody tr')].find((row) => row.cells[0].textContent === '{clip}')"
    tab.run(f"{row}.cells[1].click()")
    assert tab.run("document.getElementById('compare-choice').value") == clip
    worst = "(({ error }) => error.indexOf(Math.max(...error)))(Hobble.material.compare.clips[1])"
    assert tab.until(f"Number(document.getElementById('compare-time').value) === {worst}")


def rows_of(tab: Browser, table: str) -> list[str]:
    """The first cell of each row that a table shows."""
    return tab.run(f"[...{table}.tBodies[0].rows].map((row) => row.cells[0].textContent)")


def test_tables_sort_show_ten_rows_and_become_csv(tab: Browser, material: ReportMaterial) -> None:
    table = "document.querySelector('table[data-csv=\"test-accuracy\"]')"
    clips = sorted(material.measurements["accuracy"]["clips"], key=lambda row: row["mean"])
    ranked = [row["clip"] for row in clips]
    for order, name in ((ranked, "ascending"), (ranked[::-1], "descending")):
        tab.run(f"{table}.tHead.rows[0].cells[3].querySelector('button').click()")
        assert rows_of(tab, table) == order[:10]
        assert tab.run(f"{table}.tHead.rows[0].cells[3].getAttribute('aria-sort')") == name
    lines = tab.run(f"Hobble.csv({table})").split("\r\n")
    assert lines[0] == 'clip,split,frames,mean,sd,"position error, cm"'
    worst = clips[-1]
    assert lines[1].startswith(f"{worst['clip']},{worst['split']},{worst['frames']},{worst['mean']},")

    table = "document.querySelector('table[data-csv=\"test-injury-responses\"]')"
    assert len(rows_of(tab, table)) == 10
    tab.run(f"for (let i = 0; i < 2; i++) {table}.tHead.rows[0].cells[2].querySelector('button').click()")
    rows = csv.DictReader(io.StringIO(tab.run(f"Hobble.csv({table})")))
    changes = [float(row["change of the pose, cm"]) for row in rows]
    shown = float(tab.run(f"{table}.tBodies[0].rows[0].cells[2].textContent"))
    assert shown == pytest.approx(max(changes), abs=0.01)
    tab.run("document.querySelector('[data-all=\"test-injury-responses\"]').click()")
    assert len(rows_of(tab, table)) == len(changes) > 10


def test_the_page_is_short_until_sections_are_opened(tab: Browser) -> None:
    """And a link opens the section that it names."""
    tab.run(f"{FOLDS}.forEach((fold) => {{ fold.open = false; }})")
    assert tab.run("document.documentElement.scrollHeight") < 9000
    tab.run("location.hash = '#costs'")
    assert tab.until(
        f"{FOLDS}.filter((fold) => fold.open).map((fold) => fold.parentElement.id).join() === 'costs'"
    )
    tab.run("location.hash = '#play'")
    assert tab.until("document.getElementById('report').offsetParent === null")
    tab.run("location.hash = '#summary'")
    assert tab.until("document.getElementById('play').offsetParent === null")
    tab.run(f"{FOLDS}.forEach((fold) => {{ fold.open = true; }})")


def test_themes_recolour_page_and_charts(tab: Browser) -> None:
    tab.run("Hobble.drawAll()")
    read = """[getComputedStyle(document.body).backgroundColor,
      document.querySelector('[data-chart="learning-curve"]').data[1].line.color]"""
    light, dark = ((tab.run("document.getElementById('theme').click()"), tab.run(read))[1] for _ in range(2))
    assert light == ["rgb(252, 251, 248)", "rgb(11, 110, 116)"]
    assert dark == ["rgb(20, 23, 26)", "rgb(88, 188, 192)"]
    tab.run("document.getElementById('theme').click()")


@pytest.mark.parametrize("width", [390, 820, 1440])
def test_the_page_fits_its_window(tab: Browser, width: int) -> None:
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
def test_no_text_of_a_chart_is_cut_or_covered(tab: Browser) -> None:
    tab.run("Hobble.drawAll()")
    assert tab.until(f"{CUT}.length === 0"), tab.run(CUT)


@pytest.mark.slow
def test_axe_finds_no_accessibility_problem(tab: Browser, modules: Path) -> None:
    """In a wide and in a narrow window, in light and in dark."""
    for width, theme in itertools.product((1440, 390), ("light", "dark")):
        tab.size(width, 900)
        tab.run(f"document.documentElement.dataset.theme = '{theme}'")
        assert tab.violations(modules) == []
    tab.run("delete document.documentElement.dataset.theme")
    tab.size(1280, 900)


@pytest.mark.slow
def test_every_chart_is_printed_in_light_colours(tab: Browser) -> None:
    tab.run("document.querySelectorAll('details').forEach((each) => { each.open = false; })")
    tab.run("dispatchEvent(new Event('beforeprint'))")
    assert tab.run("getComputedStyle(document.body).backgroundColor") == "rgb(252, 251, 248)"
    assert tab.run("document.querySelectorAll('details:not([open])').length") == 0
    assert tab.until(DRAWN)
    tab.run("dispatchEvent(new Event('afterprint'))")


def test_the_page_prints_no_console_message_and_makes_no_request(tab: Browser) -> None:
    """Runs last, after all tests above have used the page.

    To draw a heatmap, plotly asks whether the browser draws pixels with sharp edges. It does so with an
    inline style, which the page's policy refuses. Plotly then draws each cell by itself.
    """
    assert [said for said in tab.console if not said.startswith("Applying inline style")] == []
    assert tab.fetched == []
