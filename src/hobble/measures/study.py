"""Write tables of people's answers to the questionnaire, numbered III to XVI as in the study of Ferre (2019).

hobble study results/limp/questionnaire/films.json ANSWERS.json ... --out FOLDER

On the page results/<configuration>/questionnaire/questionnaire.html, people see films of a hurt character,
tick the parts of the body that hurt and mark how fluid the motion is. The page saves a file of answers for
each person. From these files, the command writes a table for each film, with how many people ticked each part
of the body, and a table for all films. It also writes tables.md, which has all tables.
"""

# The numerals are those of the tables in the study of Quentin Ferre. We only know how many tables he has, and
# that people named 82 % of the hurt parts. We assume one table for each film and one for all films.

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from hobble.core.declared import read_declared
from hobble.core.errors import InputError
from hobble.core.files import read_json, write_csv, write_text
from hobble.core.untrusted import printable, read_yaml
from hobble.report.gather import PUBLISHED

FLUID_MARKS = range(1, 6)  # 1 to 5, for how fluid a motion is
NUMERALS = ("III", "IV", "V", "VI", "VII", "VIII", "IX", "X", "XI", "XII", "XIII", "XIV", "XV", "XVI")
ALL = "all"  # stands for the number or the kind of a film in a row for several films or for all kinds
USE_FILMS_JSON = "Use the films.json in the folder of questionnaire.html."
USE_SAVED_FILE = "Use the file that the page saved, unchanged."
Rows = list[dict[str, Any]]  # the rows of a table: column -> value


@dataclass(frozen=True)
class ShownFilm:
    """A film of the questionnaire, as films.json describes it.

    number: from 1. kind: "one part", "several parts" or "change of gait". parts: the parts of the body that
    hurt in it.
    """

    number: Annotated[int, Field(alias="film", strict=True)]
    kind: str
    parts: tuple[str, ...]


@dataclass(frozen=True)
class Study:
    """A questionnaire: its films and what people can answer.

    name: identifies the questionnaire. Each file of answers has this name, so that answers to another
    questionnaire are refused. configuration: name of the configuration whose network made the films. parts:
    the parts of the body that people can tick.
    """

    name: Annotated[str, Field(alias="study")]
    configuration: str
    parts: tuple[str, ...]
    films: tuple[ShownFilm, ...]


@dataclass(frozen=True)
class FilmAnswer:
    """One person's answer to a film.

    film: the film's number. parts: the ticked parts. fluid: mark for how fluid the motion is, from 1 to 5.
    """

    film: Annotated[int, Field(strict=True)]
    parts: tuple[str, ...]
    fluid: Annotated[int, Field(strict=True, ge=FLUID_MARKS[0], le=FLUID_MARKS[-1])]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `hobble study`."""
    parser.add_argument("films", type=Path, help="the file films.json in the folder of the questionnaire")
    parser.add_argument(
        "answers", type=Path, nargs="+", help="files that the questionnaire saved, one for each person"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("tables"), help="folder to write the tables into (default tables)"
    )


def run(options: argparse.Namespace) -> int:
    """Write the tables and print the scores over all films. Returns the exit status."""
    study = read_study(options.films)
    people = [read_answers(path, study) for path in options.answers]
    published = read_yaml(PUBLISHED)["recognition"]["share"]
    write_tables(options.out, study, answer_rows_by_numeral(study, people), published)
    films = {film.number: film for film in study.films}
    overall = score_answers([(films[answer.film], answer) for answers in people for answer in answers])
    print(f"{len(people)} people, {overall['answers']} answers. Tables: {options.out}/tables.md")
    seen, seen_without_side = (100 * overall[key] for key in ("seen", "seen_without_side"))
    print(
        f"Hurt parts that were ticked: {seen:.0f} % (Ferre 2019: {100 * published:.0f} %), "
        f"{seen_without_side:.0f} % if left and right count as the same. Fluid: {overall['fluid']:.2f} of 5."
    )
    return 0


def read_study(path: str | Path) -> Study:
    """Read films.json, which the workflow's rule `questionnaire` writes.

    Raises InputError if the file is damaged.
    """
    return read_declared(path, "the questionnaire", Study, read_json(path), USE_FILMS_JSON)


def read_answers(path: str | Path, study: Study) -> list[FilmAnswer]:
    """One person's answers, in the order in which the films were shown.

    Raises InputError for answers to another questionnaire, a film with no answer or with two, an unknown film
    or part, or a mark that is not 1 to 5.
    """
    data = read_json(path)
    if not isinstance(data, dict) or data.get("study") != study.name:
        found = printable(data.get("study") if isinstance(data, dict) else data, 40)
        raise InputError(
            path,
            f"answers another questionnaire: {found}, not {study.name}",
            fix="Use the films.json of the questionnaire that was answered.",
        )
    if not isinstance(rows := data.get("answers"), list):
        raise InputError(path, "has no list `answers`", fix=USE_SAVED_FILE)
    answers = [_read_answer(path, f"answer {i}", row, study) for i, row in enumerate(rows, 1)]
    numbers = [answer.film for answer in answers]
    if twice := [n for n, answered in Counter(numbers).items() if answered > 1]:
        raise InputError(path, f"film {min(twice)} is answered twice", fix=USE_SAVED_FILE)
    if missing := [film.number for film in study.films if film.number not in numbers]:
        raise InputError(path, f"film {missing[0]} is not answered", fix="Answer all films and save again.")
    return answers


def _read_answer(path: str | Path, where: str, row: Any, study: Study) -> FilmAnswer:
    """The answer in an item of the list `answers`. where: the item, for messages."""
    answer = read_declared(path, where, FilmAnswer, row, USE_SAVED_FILE)
    if answer.film not in [shown.number for shown in study.films]:
        raise InputError(path, f"{where}: there is no film {answer.film}", fix=USE_SAVED_FILE)
    if unknown := [part for part in answer.parts if part not in study.parts]:
        problem = f"{where}: no such part: {printable(unknown[0], 40)}"
        raise InputError(path, problem, fix=f"The parts are {', '.join(study.parts)}.")
    return replace(answer, parts=tuple(dict.fromkeys(answer.parts)))


def answer_rows_by_numeral(study: Study, people: Sequence[Sequence[FilmAnswer]]) -> dict[str, Rows]:
    """Numeral -> rows of the table with this numeral. The last table is for all films.

    people: the answers of each person. With more than thirteen films, the numerals continue as XVI+1, XVI+2
    and so on.
    """
    # Film number -> the answers to this film.
    answers: dict[int, list[FilmAnswer]] = {
        film.number: [a for of_person in people for a in of_person if a.film == film.number]
        for film in study.films
    }
    numerals = [*NUMERALS, *(f"XVI+{i}" for i in range(1, len(study.films)))]
    tables = [*(film_rows(study, film, answers[film.number]) for film in study.films)]
    return dict(zip(numerals, [*tables, summary_rows(study, answers)], strict=False))


def film_rows(study: Study, film: ShownFilm, answers: Sequence[FilmAnswer]) -> Rows:
    """The table of one film, with a row for each part that people can tick.

    answers: those to this film. Keys of a row. part: its name. hurts: whether it hurts in the film. people:
    how many people ticked it. share: share of people who ticked it.
    """
    ticked = {part: sum(part in a.parts for a in answers) for part in study.parts}
    return [
        {
            "part": part,
            "hurts": part in film.parts,
            "people": count,
            "share": _ratio(count, len(answers)),
        }
        for part, count in ticked.items()
    ]


def summary_rows(study: Study, answers: Mapping[int, Sequence[FilmAnswer]]) -> Rows:
    """The table of all films: a row for each film, one for each kind of film, and one for all films.

    answers: film number -> the answers to this film.

    Keys of a row. film: its number, or ALL in a row for several films. kind: the kind of film, or ALL. parts:
    the parts that hurt. The other keys are from `score_answers`.
    """
    rows = [
        {"film": str(film.number), "kind": film.kind, "parts": ", ".join(film.parts)}
        | score_answers([(film, a) for a in answers[film.number]])
        for film in study.films
    ]
    for kind in [*dict.fromkeys(film.kind for film in study.films), ALL]:
        of_kind = [(f, a) for f in study.films if kind in (f.kind, ALL) for a in answers[f.number]]
        rows.append({"film": ALL, "kind": kind, "parts": ""} | score_answers(of_kind))
    return rows


def score_answers(answers: Sequence[tuple[ShownFilm, FilmAnswer]]) -> dict[str, Any]:
    """How well people answered. answers: pairs of a film and one person's answer to it.

    Keys of the result. answers: number of answers. seen: share of the hurt parts that were ticked. wrong:
    mean number of ticked parts that do not hurt. exact: share of the answers that tick exactly the hurt
    parts. seen_without_side, exact_without_side: `seen` and `exact` if left and right count as the same.
    fluid: mean of the marks from 1 to 5 for how fluid the motion is. fluid_sd: standard deviation of these
    marks. A value that cannot be computed is None.
    """
    # (hurt parts, ticked parts) of each answer, with and without left and right.
    sides = [(set(film.parts), set(answer.parts)) for film, answer in answers]
    no_sides = [
        ({without_side(p) for p in hurt}, {without_side(p) for p in ticked}) for hurt, ticked in sides
    ]
    fluid = [a.fluid for _, a in answers]

    def seen(pairs: Sequence[tuple[set[str], set[str]]]) -> float | None:
        return _ratio(sum(len(hurt & ticked) for hurt, ticked in pairs), sum(len(hurt) for hurt, _ in pairs))

    def exact(pairs: Sequence[tuple[set[str], set[str]]]) -> float | None:
        return _ratio(sum(hurt == ticked for hurt, ticked in pairs), len(pairs))

    return {
        "answers": len(answers),
        "seen": seen(sides),
        "seen_without_side": seen(no_sides),
        "wrong": _ratio(sum(len(ticked - hurt) for hurt, ticked in sides), len(answers)),
        "exact": exact(sides),
        "exact_without_side": exact(no_sides),
        "fluid": round(float(np.mean(fluid)), 5) if fluid else None,
        "fluid_sd": round(float(np.std(fluid, ddof=1)), 5) if len(fluid) > 1 else None,
    }


def without_side(part: str) -> str:
    """The part without its side: "left thigh" and "right thigh" become "thigh"."""
    return part.removeprefix("left ").removeprefix("right ")


def write_tables(
    folder: str | Path, study: Study, rows_by_numeral: Mapping[str, Rows], published: float
) -> None:
    """Write table-III.csv and so on, and tables.md with all tables.

    rows_by_numeral: numeral -> rows, from `answer_rows_by_numeral`. published: the share of hurt parts that
    people named in the study of Quentin Ferre (2019).
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    text = [f"# What people saw in the films of {study.configuration}\n"]
    for (numeral, rows), film in zip(rows_by_numeral.items(), [*study.films, None], strict=True):
        write_csv(folder / f"table-{numeral}.csv", rows)
        title = f"film {film.number}, {film.kind}: {', '.join(film.parts)}" if film else "all films"
        lines = [list(rows[0]), ["---"] * len(rows[0]), *([_cell(v) for v in row.values()] for row in rows)]
        text += [f"## Table {numeral}: {title}\n", *(f"| {' | '.join(line)} |" for line in lines), ""]
    text.append(
        f"Compare `seen` with Quentin Ferre (2019): people named {100 * published:.0f} % of the hurt parts.\n"
    )
    write_text(folder / "tables.md", "\n".join(text))


def _cell(value: Any) -> str:
    """A value as text. None and False are empty cells."""
    if value is None or value is False:
        return ""
    return "yes" if value is True else f"{value:.2f}" if isinstance(value, float) else str(value)


def _ratio(part: float, whole: float) -> float | None:
    """`part` divided by `whole`; None if `whole` is 0."""
    return round(part / whole, 5) if whole else None
