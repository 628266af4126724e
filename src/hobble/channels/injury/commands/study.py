"""Write tables of people's answers to the questionnaire, numbered III to XVI as in the study of Ferre (2019).

hobble study results/limp/questionnaire/films.json ANSWERS.json ... --out FOLDER

On the page results/<configuration>/questionnaire/questionnaire.html, people see films of a hurt character and
tick the parts of the body that hurt. The page saves a file of answers for each person. From these files, the
command writes a table for each film, with how many people ticked each part of the body, and a table for all
films. It also writes tables.md, which has all tables.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from hobble.channels.injury.study.answer_tables import answer_rows_by_numeral, score_answers, write_tables
from hobble.channels.injury.study.answers import read_answers, read_study
from hobble.core.untrusted import read_yaml
from hobble.report.gather import PUBLISHED


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
    print(f"Hurt parts that were ticked: {seen:.0f} % (Ferre 2019: {100 * published:.0f} %),", end=" ")
    print(
        f"{seen_without_side:.0f} % if left and right count as the same. Fluid: {overall['fluid']:.2f} of 5."
    )
    return 0
