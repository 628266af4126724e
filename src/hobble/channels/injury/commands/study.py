"""Write tables III to XVI of the injury study of Ferre (2019) from the answers to its questionnaire.

hobble study results/limp/questionnaire/films.json ANSWERS.json ... --out FOLDER

The page results/<configuration>/questionnaire/questionnaire.html saves a file of answers for each person.
This writes a table for each film (how many people ticked each part of the body), a table for all films, and
tables.md with all tables.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from hobble.channels.injury.study.answer_tables import scores, tables, write_tables
from hobble.channels.injury.study.answers import read_answers, read_study
from hobble.core.untrusted import read_yaml
from hobble.report.gather import PUBLISHED


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `hobble study`."""
    parser.add_argument("films", type=Path, help="films.json beside the questionnaire")
    parser.add_argument(
        "answers", type=Path, nargs="+", help="files that the page saved, one for each person"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("tables"), help="folder to write the tables into (default tables)"
    )


def run(options: argparse.Namespace) -> int:
    """Write the tables and print the result over all films. Returns the exit status."""
    study = read_study(options.films)
    people = [read_answers(path, study) for path in options.answers]
    theirs = read_yaml(PUBLISHED)["recognition"]["share"]
    write_tables(options.out, study, tables(study, people), theirs)
    film = {film.number: film for film in study.films}
    all_of = scores([(film[answer.film], answer) for some in people for answer in some])
    print(f"{len(people)} people, {all_of['answers']} answers. Tables: {options.out}/tables.md")
    seen, sides = (100 * all_of[key] for key in ("seen", "seen_without_side"))
    print(f"Parts that hurt and were ticked: {seen:.0f} %, without side {sides:.0f} %", end=" ")
    print(f"(Ferre 2019: {100 * theirs:.0f} %). Fluid: {all_of['fluid']:.2f} of 5.")
    return 0
