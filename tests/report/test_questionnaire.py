"""The questionnaire in a browser: each film once, in random order, and answers that can be counted."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from hobble.core.files import read_json
from hobble.measures import films
from hobble.measures.films import FILMS, write_questionnaire
from hobble.measures.study import PARTS, QUESTIONS, read_answers, read_study
from hobble.models.network import Network
from hobble.runtime import Runtime
from tests.report.browser import Browser, opened

SHORT = FILMS[3:7]


@pytest.fixture(scope="module")
def made(
    network: Network, runtime: Runtime, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, dict[str, Any]]:
    """The page with four small and short films."""
    folder = tmp_path_factory.mktemp("questionnaire")
    with pytest.MonkeyPatch.context() as patch:
        for name, seconds in (("WARM_UP_SECONDS", 0.1), ("HEALTHY_SECONDS", 0.1), ("HURT_SECONDS", 0.3)):
            patch.setattr(films, name, seconds)
        return folder, write_questionnaire(network, folder, runtime, "example", SHORT, "sided", size=48)


@pytest.fixture(scope="module")
def tab(made: tuple[Path, dict[str, Any]], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    yield from opened((made[0] / "questionnaire.html").read_text(), tmp_path_factory.mktemp("asked"))


def again(tab: Browser, forget: bool = False) -> None:
    """Open the page again, with or without the answers that the browser has stored, and begin."""
    if forget:
        tab.run("localStorage.clear()")
    tab.open(tab.run("location.href"))
    assert tab.until("!!globalThis.Study")


def click(tab: Browser, *selectors: str) -> None:
    for selector in selectors:
        tab.run(f"document.querySelector({json.dumps(selector)}).click()")


def test_injuries_are_listed_in_a_file_and_not_in_the_page(made: tuple[Path, dict[str, Any]]) -> None:
    folder, written = made
    assert read_json(folder / "films.json") == json.loads(json.dumps(written))
    assert [row["parts"] for row in written["films"]] == [list(film.severities) for film in SHORT]
    assert written["films"][0]["links"] == ["LeftForeArm-LeftHand"]
    assert all(row["from_healthy_cm"] > 0 for row in written["films"])
    page = (folder / "questionnaire.html").read_text()
    assert not any(kind in page for kind in ("several parts", "LeftForeArm", "change of gait"))
    assert page.count('"webp"') == 4


def test_each_film_is_asked_about_once_and_the_answers_can_be_counted(
    tab: Browser, made: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    again(tab, forget=True)
    tab.run("document.getElementById('person').value = 'Ann 1'")
    click(tab, "#begin")
    film, disabled = "document.getElementById('film')", "document.getElementById('next').disabled"
    assert tab.until(f"{film}.complete && {film}.naturalWidth === 48")
    ticked = []
    for i in range(4):
        assert tab.run("document.getElementById('which').textContent") == f"Film {i + 1} of 4"
        assert tab.run(disabled)
        part = PARTS["sided"][i]
        click(tab, f"#parts input[value='{part}']")
        if i == 2:  # "none of these" takes the ticks back
            click(tab, "#parts input[value=nothing]")
        for key, (_, choices) in QUESTIONS.items():
            assert tab.run(disabled), f"{key} is not answered yet"
            click(tab, f"#questions-asked input[name={key}][value='{choices[i % len(choices)]}']")
        assert not tab.run(disabled)
        click(tab, "#again", "#next")
        ticked.append(() if i == 2 else (part,))
    assert not tab.run("document.getElementById('done').hidden")
    (tmp_path / "answers.json").write_text(tab.run("document.getElementById('text').value"))
    data = json.loads((tmp_path / "answers.json").read_text())
    assert [row["plays"] for row in data["answers"]] == [2] * 4
    answers = read_answers(tmp_path / "answers.json", read_study(made[0] / "films.json"))
    assert sorted(data["order"]) == [a.film for a in answers] == [film.number for film in SHORT]
    answers.sort(key=lambda a: data["order"].index(a.film))
    assert [a.parts for a in answers] == ticked
    assert [a.realism for a in answers] == ["very poor", "poor", "fair", "good"]
    assert [a.noticed for a in answers] == ["yes", "no", "yes", "no"]
    assert tab.console == tab.fetched == []


@pytest.mark.slow
def test_orders_differ_and_a_reopened_page_continues(tab: Browser) -> None:
    orders = set()
    for _ in range(12):
        again(tab, forget=True)
        click(tab, "#begin")
        orders.add(tuple(tab.run("Study.state.order")))
    assert len(orders) > 3
    tab.run(
        "document.querySelectorAll('#questions fieldset').forEach((f) => f.querySelector('input').click())"
    )
    click(tab, "#next")
    order = tab.run("Study.state.order")
    again(tab)
    assert tab.until("document.getElementById('resumed').textContent.includes('answered 1 of 4')")
    click(tab, "#begin")
    assert tab.run("document.getElementById('which').textContent") == "Film 2 of 4"
    assert tab.run("Study.state.order") == order
