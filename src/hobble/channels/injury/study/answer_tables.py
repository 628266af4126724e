"""Makes tables of people's answers to the questionnaire: III to XV for thirteen films, XVI for all films.

People see films of a character and tick the parts of its body that seem hurt. The numerals are those of the
tables in the study of Quentin Ferre (2019). We only know how many tables he has, and that people named 82 %
of the hurt parts. We assume one table for each film and one for all films.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels.injury.study.answers import FilmAnswer, ShownFilm, Study
from hobble.channels.injury.study.films import without_side
from hobble.core.files import write_csv, write_text

NUMERALS = ("III", "IV", "V", "VI", "VII", "VIII", "IX", "X", "XI", "XII", "XIII", "XIV", "XV", "XVI")
ALL = "all"  # stands for the number or the kind of a film in a row for several films or for all kinds
Rows = list[dict[str, Any]]  # the rows of a table: column -> value


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
    out = {numerals[i]: film_rows(study, film, answers[film.number]) for i, film in enumerate(study.films)}
    out[numerals[len(study.films)]] = summary_rows(study, answers)
    return out


def film_rows(study: Study, film: ShownFilm, answers: Sequence[FilmAnswer]) -> Rows:
    """The table of one film, with a row for each part that people can tick.

    answers: those to this film. Keys of a row. part: its name. hurts: whether it hurts in the film. people:
    how many people ticked it. share: share of people who ticked it.
    """
    return [
        {
            "part": part,
            "hurts": part in film.parts,
            "people": (ticked := sum(part in a.parts for a in answers)),
            "share": _ratio(ticked, len(answers)),
        }
        for part in study.parts
    ]


def summary_rows(study: Study, answers: Mapping[int, Sequence[FilmAnswer]]) -> Rows:
    """The table of all films: a row for each film, one for each kind of film, and one for all films.

    answers: film number -> the answers to this film.

    Keys of a row. film: its number, or ALL in a row for several films. kind: the kind of film, or ALL. parts:
    the parts that hurt. The other keys are from `scores`.
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
    seen = sum(part in a.parts for film, a in answers for part in film.parts)
    # (hurt parts, ticked parts) of each answer, without left and right.
    no_sides = [({without_side(p) for p in f.parts}, {without_side(p) for p in a.parts}) for f, a in answers]
    fluid = [a.fluid for _, a in answers]
    return {
        "answers": len(answers),
        "seen": _ratio(seen, sum(len(film.parts) for film, _ in answers)),
        "seen_without_side": _ratio(
            sum(len(hurt & ticked) for hurt, ticked in no_sides), sum(len(hurt) for hurt, _ in no_sides)
        ),
        "wrong": _ratio(sum(part not in film.parts for film, a in answers for part in a.parts), len(answers)),
        "exact": _ratio(sum(set(film.parts) == set(a.parts) for film, a in answers), len(answers)),
        "exact_without_side": _ratio(sum(hurt == ticked for hurt, ticked in no_sides), len(answers)),
        "fluid": round(float(np.mean(fluid)), 5) if fluid else None,
        "fluid_sd": round(float(np.std(fluid, ddof=1)), 5) if len(fluid) > 1 else None,
    }


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
        text += [f"## Table {numeral}: {title}\n", _markdown(rows), ""]
    text.append(
        f"Compare `seen` with Quentin Ferre (2019): people named {100 * published:.0f} % of the hurt parts.\n"
    )
    write_text(folder / "tables.md", "\n".join(text))


def _markdown(rows: Rows) -> str:
    """The rows as a Markdown table. All rows must have the same keys."""
    lines = [list(rows[0]), ["---"] * len(rows[0]), *([_cell(v) for v in row.values()] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _cell(value: Any) -> str:
    """A value as text. None and False are empty cells."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else ""
    return f"{value:.2f}" if isinstance(value, float) else str(value)


def _ratio(part: float, whole: float) -> float | None:
    """`part` divided by `whole`; None if `whole` is 0."""
    return round(part / whole, 5) if whole else None
