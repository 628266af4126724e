"""The questionnaire's films, and the tables of made-up answers."""

from __future__ import annotations

import csv
import json
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hobble.cli.__main__ import main
from hobble.core.errors import InputError
from hobble.measures.films import (
    CHANGE_OF_GAIT,
    FILMS,
    FPS,
    ONE_PART,
    PARTS,
    SEVERAL_PARTS,
    hurts_and_gait,
)
from hobble.measures.study import (
    NUMERALS,
    FilmAnswer,
    Study,
    answer_rows_by_numeral,
    read_answers,
    read_study,
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """films.json as the rule writes it."""
    films = [{"film": f.number, "kind": f.kind, "parts": list(f.parts)} for f in FILMS]
    study = {"study": "abc", "configuration": "limp", "parts": PARTS, "films": films}
    (tmp_path / "films.json").write_text(json.dumps(study))
    return tmp_path


@pytest.fixture
def study(folder: Path) -> Study:
    return read_study(folder / "films.json")


def write(folder: Path, name: str, says: Callable[[Any], tuple[list[str], int]], **changed: Any) -> Path:
    """The answers of a person: `says(film)` for each film. The films are shown in reverse order."""
    answers = [dict(zip(("parts", "fluid"), says(f), strict=True)) | {"film": f.number} for f in FILMS[::-1]]
    data = {"study": "abc", "person": name, "order": [], "answers": answers} | changed
    path = folder / f"{name}.json"
    path.write_text(json.dumps(data))
    return path


def test_the_thirteen_films_have_the_kinds_of_the_study() -> None:
    assert Counter(film.kind for film in FILMS) == {ONE_PART: 4, SEVERAL_PARTS: 5, CHANGE_OF_GAIT: 4}
    assert [film.number for film in FILMS] == list(range(1, 14))
    assert len({(film.parts, film.gaits) for film in FILMS}) == 13
    for film in FILMS:
        assert set(film.parts) <= set(PARTS)
        assert (len(film.parts) == 1) if film.kind == ONE_PART else True
        assert (len(film.parts) > 1) if film.kind == SEVERAL_PARTS else True
        assert (film.gaits[0] != film.gaits[1]) == (film.kind == CHANGE_OF_GAIT)
    assert any("forearm" in part for film in FILMS for part in film.parts)


@pytest.mark.parametrize("film", FILMS)
def test_each_film_starts_healthy_and_changes_gait_only_while_hurt(film) -> None:
    states = [hurts_and_gait(film, f) for f in range(round(film.seconds * FPS))]
    hurts = [hurt for hurt, _ in states]
    assert hurts.index(True) == 3 * FPS
    assert all(hurts[3 * FPS :])
    gaits = [gait for _, gait in states]
    assert (gaits[0], gaits[-1]) == film.gaits
    assert len(set(gaits[: 5 * FPS])) == 1, "two seconds hurt before the gait changes"


def right(film) -> tuple[list[str], int]:
    return list(film.parts), 5


def mirrored(film) -> tuple[list[str], int]:
    swap = {"left": "right", "right": "left"}
    return [f"{swap[part.split()[0]]} {part.split(' ', 1)[1]}" for part in film.parts], 3


def back(film) -> tuple[list[str], int]:
    return ["lower back"], 1


def test_known_answers_give_known_tables(folder: Path, study: Study) -> None:
    """Of three people one names all parts, one confuses the sides, and one always says the back."""
    people = [read_answers(write(folder, says.__name__, says), study) for says in (right, mirrored, back)]
    made = answer_rows_by_numeral(study, people)
    assert tuple(made) == NUMERALS
    for numeral, film in zip(NUMERALS, FILMS, strict=False):
        rows = {row["part"]: row for row in made[numeral]}
        assert {part for part, row in rows.items() if row["hurts"]} == set(film.parts)
        opposite = mirrored(film)[0]
        for part, row in rows.items():
            expected = (part in film.parts) + (part in opposite) + (part == "lower back")
            assert row["people"] == expected, (numeral, part)
            assert row["share"] == pytest.approx(expected / 3, abs=1e-5)
    summary = made["XVI"]
    assert [row["film"] for row in summary] == [*map(str, range(1, 14)), "all", "all", "all", "all"]
    assert [row["kind"] for row in summary[13:]] == [ONE_PART, SEVERAL_PARTS, CHANGE_OF_GAIT, "all"]
    everything = summary[-1]
    # Film 8 hurts two right parts, films 6 and 9 parts of both sides: none is named in a mirror.
    assert everything["answers"] == 39
    assert everything["seen"] == pytest.approx(1 / 3, abs=1e-5)
    assert everything["seen_without_side"] == pytest.approx(2 / 3, abs=1e-5)
    assert everything["exact"] == pytest.approx(1 / 3, abs=1e-5)
    assert everything["exact_without_side"] == pytest.approx(2 / 3, abs=1e-5)
    parts = sum(len(film.parts) for film in FILMS)
    assert everything["wrong"] == pytest.approx((0 + parts + 13) / 39, abs=1e-5)
    assert everything["fluid"] == 3.0
    assert everything["fluid_sd"] == pytest.approx((4 * 26 / 38) ** 0.5, abs=1e-5)


def test_naming_one_of_three_hurt_parts_counts_a_third(study: Study) -> None:
    """In film 9 three parts hurt, and one of two people ticks one of them. In film 1 both tick one part too
    many.
    """
    first = [FilmAnswer(f.number, f.parts[:1] if f.number == 9 else f.parts, 4) for f in FILMS]
    second = [FilmAnswer(f.number, () if f.number == 9 else f.parts, 2) for f in FILMS]
    rows = {row["film"]: row for row in answer_rows_by_numeral(study, [first, second])["XVI"][:13]}
    assert rows["9"]["seen"] == pytest.approx(1 / 6, abs=1e-5)
    assert rows["9"]["exact"] == 0
    assert rows["9"]["wrong"] == 0
    assert rows["1"]["seen"] == rows["1"]["exact"] == 1
    assert rows["1"]["fluid"] == 3
    assert rows["1"]["fluid_sd"] == pytest.approx(2**0.5, abs=1e-5)


def test_the_command_writes_fourteen_tables(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [str(write(folder, says.__name__, says)) for says in (right, mirrored)]
    assert main(["study", str(folder / "films.json"), *files, "--out", str(folder / "out")]) == 0
    assert "2 people, 26 answers" in (said := capsys.readouterr().out)
    assert "ticked: 50 % (Ferre 2019: 82 %), 100 % if left and right count as the same." in said
    assert "Fluid: 4.00 of 5." in said
    names = {f"table-{numeral}.csv" for numeral in NUMERALS} | {"tables.md"}
    assert {path.name for path in (folder / "out").iterdir()} == names
    with open(folder / "out" / "table-IX.csv") as file:
        ticked = {row["part"]: row["people"] for row in csv.DictReader(file)}
    assert ticked["left shank"] == ticked["left forearm"] == ticked["right shank"] == "1"
    assert sum(map(int, ticked.values())) == 4
    text = (folder / "out" / "tables.md").read_text()
    assert "## Table IX: film 7, several parts: left shank, left forearm" in text
    assert "## Table XVI: all films" in text


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d | {"study": "old"}, "answers another questionnaire"),
        (lambda d: d | {"answers": d["answers"][1:]}, "film 13 is not answered"),
        (lambda d: d | {"answers": [d["answers"][0], *d["answers"]]}, "film 13 is answered twice"),
        (lambda d: d | {"answers": [d["answers"][0] | {"parts": ["tail"]}]}, "answer 1: no such part: tail"),
        (lambda d: d | {"answers": [d["answers"][0] | {"fluid": 6}]}, "answer 1: fluid: .* 5"),
        (lambda d: d | {"answers": [d["answers"][0] | {"fluid": True}]}, "answer 1: fluid: "),
        (lambda d: d | {"answers": [d["answers"][0] | {"film": 14}]}, "there is no film 14"),
        (lambda d: d | {"answers": ["\x1b[31m"]}, "answer 1: "),
        (lambda d: d | {"answers": 3}, "has no list `answers`"),
        (lambda d: [d], "answers another questionnaire"),
    ],
)
def test_a_malformed_file_of_answers_is_refused_with_its_place(
    folder: Path, study: Study, change: Callable[[Any], Any], message: str
) -> None:
    path = write(folder, "someone", right)
    path.write_text(json.dumps(change(json.loads(path.read_text()))))
    with pytest.raises(InputError, match=message) as error:
        read_answers(path, study)
    assert "someone.json" in str(error.value)
