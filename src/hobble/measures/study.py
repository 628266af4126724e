"""Write tables of people's answers to the questionnaire, beside Tables III to XVI of Ferre et al. (2019).

hobble study results/limp/questionnaire/films.json ANSWERS.json ... --out FOLDER

On the page results/<configuration>/questionnaire/questionnaire.html, people see thirteen films of a character
that begins to hurt, and answer five questions about each. The page saves a file of answers for each person.
From these files, the command writes a table for each film (III to XV), one over all films (XVI), and
scores.csv, how often people ticked what hurts. It also writes tables.md, which has all tables. Published
numbers stand beside ours.
"""

import argparse
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import Field

from hobble.core.declared import read_declared
from hobble.core.errors import InputError
from hobble.core.files import Json, printable, read_json, read_yaml, write_tables, write_text
from hobble.report.gather import PUBLISHED

# Parts that people can tick: those of Ferre et al., and as an option (`report.parts: sided`) more exact ones.
# They include parts that hurt in no film.
PARTS = {
    "published": ("head", "arm", "stomach", "upper leg", "lower leg"),
    "sided": (
        *(
            f"{side} {part}"
            for part in ("thigh", "shank", "foot", "upper arm", "forearm")
            for side in ("left", "right")
        ),
        "lower back",
        "neck",
    ),
}
# A part without its side -> the part that stands for it in the published questionnaire.
PUBLISHED_PART = {
    "thigh": "upper leg",
    "shank": "lower leg",
    "foot": "lower leg",
    "upper arm": "arm",
    "forearm": "arm",
    "lower back": "stomach",
    "neck": "head",
}
Mark = Literal["very poor", "poor", "fair", "good", "very good"]
MARKS = get_args(Mark)
# Key of an answer -> the question, as the page asks it, and its choices. The last question is about parts.
QUESTIONS = {
    "noticed": ("Did the motion change?", ("yes", "no")),
    "fluidity": ("How fluid was the transition?", MARKS),
    "progress": ("How well did the transition progress, from its start to its end?", MARKS),
    "realism": ("How realistic was the motion in the end?", MARKS),
}
NUMERALS = ("III", "IV", "V", "VI", "VII", "VIII", "IX", "X", "XI", "XII", "XIII", "XIV", "XV", "XVI")
ALL = "all"  # stands for the number or the kind of a film in a row for several films or for all kinds
USE_FILMS_JSON = "Use the films.json in the folder of questionnaire.html."
USE_SAVED_FILE = "Use the file that the page saved, unchanged."
# Key of an answer -> the question and its choices, in the order of the published tables. The last are parts.
ASKED = {**QUESTIONS, "parts": ("Which part of the body is injured?", PARTS["published"])}
Rows = list[dict[str, Any]]  # the rows of a table: column -> value


@dataclass(frozen=True)
class ShownFilm:
    """A film of the questionnaire, as films.json describes it.

    number: from 1. kind: "one part", "several parts" or "change of gait". parts: those that hurt in it, with
    their severities in the end.
    """

    number: Annotated[int, Field(alias="film", strict=True, ge=1, le=13)]
    kind: str
    parts: tuple[str, ...]
    severities: tuple[float, ...]

    @property
    def hurts(self) -> set[str]:
        """The parts that hurt, as those of the published questionnaire, which have no side."""
        return set(map(published_part, self.parts))

    @property
    def in_words(self) -> str:
        """The hurt parts with their severities, such as "left shank 5, right thigh 10"."""
        pairs = zip(self.parts, self.severities, strict=True)
        return ", ".join(f"{part} {severity:g}" for part, severity in pairs)


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
    """One person's answer to a film. film: its number. The other fields are keys of ASKED."""

    film: Annotated[int, Field(strict=True)]
    noticed: Literal["yes", "no"]
    fluidity: Mark
    progress: Mark
    realism: Mark
    parts: tuple[str, ...]

    @property
    def ticked(self) -> set[str]:
        """The ticked parts, as those of the published questionnaire, which have no side."""
        return set(map(published_part, self.parts))


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
    """Write the tables and print the main result. Returns the exit status."""
    study, published = read_study(options.films), read_yaml(PUBLISHED)
    people = [read_answers(path, study) for path in options.answers]
    tables = study_tables(study, people, published)
    write_tables(
        options.out, {name if name == "scores" else f"table-{name}": t for name, t in tables.items()}
    )
    write_text(options.out / "tables.md", tables_as_text(study, tables))
    overall = tables["scores"][-1]
    print(f"{len(people)} people, {overall['answers']} answers. Tables: {options.out}/tables.md")
    print(
        f"Hurt parts that were ticked: {100 * overall['seen']:.0f} % (Ferre et al. 2019: "
        f"{100 * overall['published_seen']:.1f} % by their tables, "
        f"{100 * published['recognition']['share']:.0f} % in their text)."
    )
    return 0


def read_study(path: str | Path) -> Study:
    """Read films.json, which the workflow's rule `questionnaire` writes.

    Raises InputError if the file is damaged, or was made for the two questions of older versions.
    """
    return read_declared(path, "the questionnaire", Study, read_json(path, USE_FILMS_JSON), USE_FILMS_JSON)


def read_answers(path: str | Path, study: Study) -> list[FilmAnswer]:
    """One person's answers to the films, in the order of the films.

    Raises InputError for answers to another questionnaire, a film with no answer or with two, and an unknown
    film, choice or part.
    """
    data = read_json(path, USE_SAVED_FILE)
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
    numbers = Counter(answer.film for answer in answers)
    if twice := [n for n, answered in numbers.items() if answered > 1]:
        raise InputError(path, f"film {min(twice)} is answered twice", fix=USE_SAVED_FILE)
    order = [film.number for film in study.films]
    if missing := [number for number in order if number not in numbers]:
        raise InputError(path, f"film {missing[0]} is not answered", fix="Answer all films and save again.")
    return sorted(answers, key=lambda answer: order.index(answer.film))


def _read_answer(path: str | Path, where: str, row: Any, study: Study) -> FilmAnswer:
    """The answer in an item of the list `answers`. where: the item, for messages."""
    answer = read_declared(path, where, FilmAnswer, row, USE_SAVED_FILE)
    if answer.film not in [shown.number for shown in study.films]:
        raise InputError(path, f"{where}: there is no film {answer.film}", fix=USE_SAVED_FILE)
    if unknown := [part for part in answer.parts if part not in study.parts]:
        problem = f"{where}: no such part: {printable(unknown[0], 40)}"
        raise InputError(path, problem, fix=f"The parts are {', '.join(study.parts)}.")
    return replace(answer, parts=tuple(dict.fromkeys(answer.parts)))


def study_tables(study: Study, people: Sequence[Sequence[FilmAnswer]], published: Json) -> dict[str, Rows]:
    """Numeral -> rows of the published table with this numeral, and "scores" -> rows of `score_rows`.

    people: the answers of each person, from `read_answers`. published: the content of published.yaml.
    """
    theirs = {row["film"]: row for row in published["questionnaire"]}
    answers = [list(of_film) for of_film in zip(*people, strict=True)]
    tables = {
        NUMERALS[film.number - 1]: film_rows(of_film, theirs[film.number])
        for film, of_film in zip(study.films, answers, strict=True)
    }
    summary = summary_rows(list(tables.values()), published["questionnaire_summary"])
    return {**tables, NUMERALS[-1]: summary, "scores": score_rows(study.films, answers, theirs)}


def published_part(part: str) -> str:
    """The part of PARTS["published"] that stands for a part of either list: "left shank" is "lower leg"."""
    return PUBLISHED_PART.get(part.removeprefix("left ").removeprefix("right "), part)


def film_rows(answers: Sequence[FilmAnswer], published: Json) -> Rows:
    """The table of one film: how many people gave each answer, and how many did in the published study.

    answers: those of all people to this film. published: the film's entry in published.yaml. The share of a
    part is of all people, the share of another choice is of those who answered the question.
    """
    rows = []
    for number, (key, (_, choices)) in enumerate(ASKED.items(), 1):
        given = [a.ticked if key == "parts" else {getattr(a, key)} for a in answers]
        ours = [sum(choice in of_person for of_person in given) for choice in choices]
        theirs = published[key]
        of_ours, of_theirs = (len(answers), 10) if key == "parts" else (sum(ours), sum(theirs))
        rows += [
            {
                "question": f"Q{number}",
                "about": key,
                "choice": choice,
                "people": ours[i],
                "share": _ratio(ours[i], of_ours),
                "published_people": theirs[i],
                "published_share": _ratio(theirs[i], of_theirs),
            }
            for i, choice in enumerate(choices)
        ]
    return rows


def summary_rows(tables: Sequence[Rows], published: Json) -> Rows:
    """Table XVI: mean and standard deviation (n - 1) over the films, ours and published.

    Of the first question it is the share of yes, of the others the mean mark, from 1 (very poor) to 5.
    """
    rows = []
    for number, key in enumerate(QUESTIONS, 1):
        of_films = []
        for table in tables:
            people = [row["people"] for row in table if row["about"] == key]
            weights = (1, 0) if key == "noticed" else (1, 2, 3, 4, 5)
            of_films.append(float(np.dot(people, weights)) / max(sum(people), 1))
        mean, sd = published[key]
        ours = round(float(np.mean(of_films)), 5), _sd(of_films)
        row = {"question": f"Q{number}", "about": key, "average": ours[0], "sd": ours[1]}
        rows.append(row | {"published_average": mean, "published_sd": sd})
    return rows


def score_rows(
    films: Sequence[ShownFilm], answers: Sequence[Sequence[FilmAnswer]], published: Mapping[int, Json]
) -> Rows:
    """How well people saw what hurts: a row for each film, for each kind of film, and for all films.

    answers: those to each film. published: number of a film -> its entry in published.yaml. Keys of a row.
    seen: share of the hurt parts that were ticked, as in the published questionnaire, without sides. wrong:
    mean number of ticked parts that do not hurt. exact: share of the answers that tick exactly the hurt
    parts. seen_with_side: `seen`, with left and right told apart; None if nobody was asked for the side.
    published_seen: `seen` of the published answers.
    """

    def row(name: str, kind: str, chosen: Sequence[int]) -> dict[str, Any]:
        pairs = [(films[i].hurts, a.ticked) for i in chosen for a in answers[i]]
        sided = [(set(films[i].parts), set(a.parts)) for i in chosen for a in answers[i]]
        asked = any(part not in PARTS["published"] for _, ticked in sided for part in ticked)
        theirs = [
            published[films[i].number]["parts"][PARTS["published"].index(part)]
            for i in chosen
            for part in films[i].hurts
        ]
        return {
            "film": name,
            "kind": kind,
            "parts": films[chosen[0]].in_words if name != ALL else "",
            "answers": len(pairs),
            "seen": _seen(pairs),
            "wrong": _ratio(sum(len(ticked - hurt) for hurt, ticked in pairs), len(pairs)),
            "exact": _ratio(sum(hurt == ticked for hurt, ticked in pairs), len(pairs)),
            "seen_with_side": _seen(sided) if asked else None,
            "published_seen": _ratio(sum(theirs), 10 * len(theirs)),
        }

    rows = [row(str(film.number), film.kind, [i]) for i, film in enumerate(films)]
    for kind in [*dict.fromkeys(film.kind for film in films), ALL]:
        rows.append(row(ALL, kind, [i for i, film in enumerate(films) if kind in (film.kind, ALL)]))
    return rows


def tables_as_text(study: Study, tables: Mapping[str, Rows]) -> str:
    """All tables as Markdown. Those of films have the published layout: a line for each question."""
    text = [f"# What people saw in the films of {study.configuration}\n"]
    for film, (numeral, rows) in zip(study.films, tables.items(), strict=False):
        text.append(f"## Table {numeral}: film {film.number}, {film.kind}: {film.in_words}\n")
        text += ["| question | | | | | | |", "|---|---|---|---|---|---|---|"]
        for number, (key, (question, _)) in enumerate(ASKED.items(), 1):
            for whose, end in ((f"Q{number} {question}", ""), ("Ferre et al. (2019)", "published_")):
                cells = [
                    f"{row['choice']}: {row[f'{end}people']} ({100 * row[f'{end}share']:.0f} %)"
                    for row in rows
                    if row["about"] == key
                ]
                text.append(f"| {' | '.join([whose, *cells, *[''] * (6 - len(cells))])} |")
        text.append("")
    for title, rows in (("Table XVI: all films", tables[NUMERALS[-1]]), ("Hurt parts", tables["scores"])):
        lines = [list(rows[0]), ["---"] * len(rows[0]), *([_cell(v) for v in row.values()] for row in rows)]
        text += [f"## {title}\n", *(f"| {' | '.join(line)} |" for line in lines), ""]
    return "\n".join(text)


def _seen(pairs: Sequence[tuple[set[str], set[str]]]) -> float | None:
    """The share of hurt parts that were ticked. pairs: (hurt, ticked) parts of each answer."""
    return _ratio(sum(len(hurt & ticked) for hurt, ticked in pairs), sum(len(hurt) for hurt, _ in pairs))


def _sd(values: Sequence[float]) -> float | None:
    return round(float(np.std(values, ddof=1)), 5) if len(values) > 1 else None


def _cell(value: Any) -> str:
    """A value as text. None is an empty cell."""
    return "" if value is None else f"{value:.2f}" if isinstance(value, float) else str(value)


def _ratio(part: float, whole: float) -> float | None:
    """`part` divided by `whole`; None if `whole` is 0."""
    return round(part / whole, 5) if whole else None
