"""Reads and checks the answers that the questionnaire page saves.

People see films of a character, tick the parts of its body that seem hurt, and mark how fluid its motion is.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hobble.core.errors import InputError
from hobble.core.files import read_json
from hobble.core.untrusted import printable

FLUID_MARKS = range(1, 6)  # 1 to 5, for how fluid a motion is
# Advice in error messages.
USE_FILMS_JSON = "Use the films.json in the folder of questionnaire.html."
USE_SAVED_FILE = "Use the file that the page saved, unchanged."


@dataclass(frozen=True)
class ShownFilm:
    """A film of the questionnaire, as films.json describes it.

    number: from 1. kind: "one part", "several parts" or "change of gait". parts: the parts of the body that
    hurt in it.
    """

    number: int
    kind: str
    parts: tuple[str, ...]


@dataclass(frozen=True)
class Study:
    """A questionnaire: its films and what people can answer.

    name: identifies the questionnaire. Each file of answers has this name, so that answers to another
    questionnaire are refused. configuration: name of the configuration whose network made the films. parts:
    the parts of the body that people can tick.
    """

    name: str
    configuration: str
    parts: tuple[str, ...]
    films: tuple[ShownFilm, ...]


@dataclass(frozen=True)
class FilmAnswer:
    """One person's answer to a film.

    film: the film's number. parts: the ticked parts. fluid: mark for how fluid the motion is, from 1 to 5.
    """

    film: int
    parts: tuple[str, ...]
    fluid: int


def read_study(path: str | Path) -> Study:
    """Read films.json, which the workflow's rule `questionnaire` writes.

    Raises InputError if the file is damaged.
    """
    data = _checked_object(path, read_json(path), USE_FILMS_JSON)
    try:
        films = tuple(ShownFilm(row["film"], row["kind"], tuple(row["parts"])) for row in data["films"])
        return Study(data["study"], data["configuration"], tuple(data["parts"]), films)
    except (KeyError, TypeError) as error:
        problem = f"does not describe a questionnaire: {printable(repr(error))}"
        raise InputError(path, problem, fix=USE_FILMS_JSON) from None


def read_answers(path: str | Path, study: Study) -> list[FilmAnswer]:
    """One person's answers, in the order in which the films were shown.

    Raises InputError for answers to another questionnaire, a film with no answer or with two, an unknown film
    or part, or a mark that is not 1 to 5.
    """
    data = _checked_object(path, read_json(path), USE_SAVED_FILE)
    if data.get("study") != study.name:
        raise InputError(
            path,
            f"answers another questionnaire: {printable(data.get('study'), 40)}, not {study.name}",
            fix="Use the films.json of the questionnaire that was answered.",
        )
    rows = data.get("answers")
    if not isinstance(rows, list):
        raise InputError(path, "has no list `answers`", fix=USE_SAVED_FILE)
    answers = [_checked_answer(path, i, row, study) for i, row in enumerate(rows, 1)]
    numbers = [answer.film for answer in answers]
    if twice := sorted({n for n in numbers if numbers.count(n) > 1}):
        raise InputError(path, f"film {twice[0]} is answered twice", fix=USE_SAVED_FILE)
    if missing := [film.number for film in study.films if film.number not in numbers]:
        raise InputError(path, f"film {missing[0]} is not answered", fix="Answer all films and save again.")
    return answers


def _checked_answer(path: str | Path, number: int, row: Any, study: Study) -> FilmAnswer:
    """The answer in an item of the list `answers`. number: the item's place, from 1, for messages."""
    where = f"answer {number}"
    if not isinstance(row, dict):
        raise InputError(path, f"{where} is no answer: {printable(row, 40)}", fix=USE_SAVED_FILE)
    film, parts, fluid = row.get("film"), row.get("parts"), row.get("fluid")
    if film not in [shown.number for shown in study.films] or isinstance(film, bool):
        raise InputError(path, f"{where}: there is no film {printable(film, 40)}", fix=USE_SAVED_FILE)
    if not isinstance(parts, list) or (unknown := [part for part in parts if part not in study.parts]):
        wrong = printable(parts if not isinstance(parts, list) else unknown[0], 40)
        raise InputError(
            path, f"{where}: no such part: {wrong}", fix=f"The parts are {', '.join(study.parts)}."
        )
    if not isinstance(fluid, int) or isinstance(fluid, bool) or fluid not in FLUID_MARKS:
        raise InputError(
            path,
            f"{where}: `fluid` is {printable(fluid, 40)}, but must be 1, 2, 3, 4 or 5",
            fix=USE_SAVED_FILE,
        )
    return FilmAnswer(film, tuple(dict.fromkeys(parts)), fluid)


def _checked_object(path: str | Path, data: Any, fix: str) -> dict[str, Any]:
    """`data`, the content of a JSON file. Raises InputError with the advice `fix` unless it is a dict."""
    if not isinstance(data, dict):
        raise InputError(path, "is not an object of keys and values", fix=fix)
    return data
