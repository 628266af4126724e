"""The questionnaire's films, and the tables of answers beside those of the published study."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.cli.__main__ import main
from hobble.core.errors import InputError
from hobble.core.files import read_yaml
from hobble.measures import study as module
from hobble.measures.films import CHANGE_OF_GAIT, FILMS, ONE_PART, SEVERAL_PARTS, put_side_by_side
from hobble.measures.study import MARKS, NUMERALS, PARTS, QUESTIONS
from hobble.report.gather import PUBLISHED

PRINTED = read_yaml(PUBLISHED)
PEOPLE = 10


def write_study(folder: Path, parts: str = "published") -> Path:
    """films.json as the rule writes it."""
    films = [
        {"film": f.number, "kind": f.kind, "parts": [*f.severities], "severities": [*f.severities.values()]}
        for f in FILMS
    ]
    study = {"study": "abc", "configuration": "limp", "parts": PARTS[parts], "films": films}
    (folder / "films.json").write_text(json.dumps(study))
    return folder / "films.json"


def write(folder: Path, name: str, says: Callable[[Any], dict[str, Any]]) -> Path:
    """The answers of a person: `says(film)` for each film. The films are shown in reverse order."""
    answers = [{"film": film.number, "plays": 1, **says(film)} for film in FILMS[::-1]]
    (folder / f"{name}.json").write_text(json.dumps({"study": "abc", "person": name, "answers": answers}))
    return folder / f"{name}.json"


def printed_answer(person: int) -> Callable[[Any], dict[str, Any]]:
    """Ten people whose counts are those of Tables III to XV. Who left out a question says no."""

    def says(film: Any) -> dict[str, Any]:
        row = PRINTED["questionnaire"][film.number - 1]
        given = {"noticed": "yes" if person < row["noticed"][0] else "no"}
        for key in ("fluidity", "progress", "realism"):
            given[key] = [mark for mark, n in zip(MARKS, row[key], strict=True) for _ in range(n)][person]
        ticked = [p for p, n in zip(PARTS["published"], row["parts"], strict=True) if person < n]
        return given | {"parts": ticked}

    return says


def tables_of(folder: Path, people: list[Callable[[Any], dict[str, Any]]]) -> dict[str, list[dict[str, Any]]]:
    study = module.read_study(folder / "films.json")
    answers = [module.read_answers(write(folder, f"p{i}", says), study) for i, says in enumerate(people)]
    return module.study_tables(study, answers, PRINTED)


@pytest.mark.parametrize(("healthy", "hurt"), [(10, 10), (7, 10), (10, 7), (4, 12), (12, 4)])
def test_two_loops_of_the_looping_picture_end_together(healthy: int, hurt: int) -> None:
    """The first pixel of each picture is its number."""
    loops = [[np.full((40, 40, 3), number, np.uint8) for number in range(n)] for n in (healthy, hurt)]
    pictures = put_side_by_side(*loops)
    assert [picture[-1, 40, 0] for picture in pictures] == list(range(hurt))
    lefts = [int(picture[-1, 0, 0]) for picture in pictures]
    steps = np.diff([*lefts, lefts[0]]) % healthy  # from the last picture on to the first again
    assert steps.sum() == healthy * max(1, round(hurt / healthy)), "as often as its usual speed allows"
    assert steps.max() - steps.min() <= 1


def test_the_published_answers_give_the_published_tables(tmp_path: Path) -> None:
    write_study(tmp_path)
    made = tables_of(tmp_path, [printed_answer(i) for i in range(PEOPLE)])
    assert tuple(made) == (*NUMERALS, "scores")
    for row in (row for numeral in NUMERALS[:-1] for row in made[numeral]):
        if row["about"] != "noticed" or row["choice"] == "yes":
            assert row["people"] == row["published_people"], row
    summary = {row["about"]: row for row in made["XVI"]}
    # As counted from Tables III to XV by hand; Table XVI prints 3.6 and .69, 3.2 and .84, 3.5 and .70.
    by_hand = {"fluidity": (3.63077, 0.64857), "progress": (3.27692, 0.81051), "realism": (3.56154, 0.72977)}
    for about, (average, sd) in by_hand.items():
        assert (summary[about]["average"], summary[about]["sd"]) == (average, sd)
    assert summary["noticed"]["published_average"] == 0.7857
    everything = made["scores"][-1]
    assert everything["answers"] == 130
    assert everything["seen"] == everything["published_seen"] == 132 / 160
    assert everything["seen_with_side"] is None
    assert [row["kind"] for row in made["scores"][13:]] == [ONE_PART, SEVERAL_PARTS, CHANGE_OF_GAIT, "all"]


def good(parts: list[str]) -> dict[str, Any]:
    return {**{key: choices[-1] for key, (_, choices) in QUESTIONS.items()}, "parts": parts}


def test_sides_count_only_where_people_were_asked_for_them(tmp_path: Path) -> None:
    """Of three people one names all parts, one confuses the sides, and one says the neck."""
    write_study(tmp_path, "sided")
    other = {"left": "right", "right": "left"}

    def mirrored(film: Any) -> dict[str, Any]:
        return good([f"{other[part.split()[0]]} {part.split(' ', 1)[1]}" for part in film.severities])

    made = tables_of(tmp_path, [lambda film: good([*film.severities]), mirrored, lambda _: good(["neck"])])
    rows = {row["film"]: row for row in made["scores"][:13]}
    assert rows["1"]["seen"] == rows["1"]["exact"] == round(2 / 3, 5)
    assert rows["1"]["seen_with_side"] == round(1 / 3, 5)
    assert rows["7"]["seen_with_side"] == round(2 / 3, 5), "both shanks hurt, so a mirror names them, too"
    assert rows["1"]["wrong"] == round(1 / 3, 5)
    assert {module.published_part(part) for part in PARTS["sided"]} == set(PARTS["published"])


def test_the_command_writes_fourteen_tables_with_the_published_beside_ours(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    films = write_study(tmp_path)
    files = [str(write(tmp_path, f"p{i}", printed_answer(i))) for i in range(PEOPLE)]
    assert main(["study", str(films), *files, "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "10 people, 130 answers" in said
    assert "ticked: 82 % (Ferre et al. 2019: 82.5 % by their tables, 82 % in their text)" in said
    names = {f"table-{numeral}.csv" for numeral in NUMERALS} | {"scores.csv", "tables.md"}
    assert {path.name for path in (tmp_path / "out").iterdir()} == names
    text = (tmp_path / "out" / "tables.md").read_text()
    assert "| Ferre et al. (2019) | yes: 5 (62 %) | no: 3 (38 %) |  |  |  |" in text


WRONG = [  # change of a file of answers, message
    (lambda d: d | {"study": "old"}, "answers another questionnaire"),
    (lambda d: d | {"answers": d["answers"][1:]}, "film 13 is not answered"),
    (lambda d: d | {"answers": [d["answers"][0], *d["answers"]]}, "film 13 is answered twice"),
    (lambda d: d | {"answers": [d["answers"][0] | {"parts": ["tail"]}]}, "answer 1: no such part: tail"),
    (lambda d: d | {"answers": [d["answers"][0] | {"fluidity": 6}]}, "answer 1: fluidity: .* 'fair'"),
    (lambda d: d | {"answers": [d["answers"][0] | {"film": 14}]}, "there is no film 14"),
    (lambda d: d | {"answers": 3}, "has no list `answers`"),
]


@pytest.mark.parametrize(("change", "message"), WRONG)
def test_a_malformed_file_of_answers_is_refused_with_its_place(
    tmp_path: Path, change: Any, message: str
) -> None:
    study, path = module.read_study(write_study(tmp_path)), write(tmp_path, "someone", printed_answer(0))
    path.write_text(json.dumps(change(json.loads(path.read_text()))))
    with pytest.raises(InputError, match=rf"someone\.json: .*{message}"):
        module.read_answers(path, study)
