"""Small files that once took minutes or ended in a traceback are refused in seconds."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hobble.channels.injury.status import read_status
from hobble.core.files import read_json
from hobble.core.untrusted import read_yaml
from hobble.labels.label_files import SourceTime, read_phase
from hobble.measures.study import FilmAnswer, ShownFilm, Study, read_answers, read_study
from hobble.motion.make import make_clip
from hobble.motion.options import ClipMotion

from .refusals import HEADER, refused, write
from .texts import SKELETON

STUDY = Study("s", "limp", ("a", "b"), tuple(ShownFilm(i, "one part", ("a",), (5.0,)) for i in range(1, 6)))


def star(joints: int) -> str:
    """A BVH file in which all joints but one are children of the root."""
    turns = "CHANNELS 3 Zrotation Xrotation Yrotation"
    joint = f"JOINT j%d\n{{\nOFFSET %d %d 5\n{turns}\nEnd Site\n{{\nOFFSET 0 1 0\n}}\n}}\n"
    text = HEADER.replace("1 Xposition", turns.removeprefix("CHANNELS "))
    text += "".join(joint % (i, i % 7, 10 + i % 3) for i in range(joints))
    rows = "".join(" ".join(str((7 * f + i) % 50) for i in range(3 + 3 * joints)) + "\n" for f in range(200))
    return f"{text}}}\nMOTION\nFrames: 200\nFrame Time: 0.0166667\n{rows}"


def status(path: Path) -> Any:
    return read_status(path, ["A-B"])


def clip(path: Path) -> Any:
    return make_clip(path, SKELETON, SKELETON.parent, "clip", "holden31", ClipMotion())


def answers(path: Path) -> list[FilmAnswer]:
    return read_answers(path, STUDY)


def answer(film: int) -> dict[str, Any]:
    marks = dict.fromkeys(("fluidity", "progress", "realism"), "fair")
    return {"film": film, "noticed": "yes", **marks, "parts": ["a"]}


def saved(**changes: Any) -> str:
    """A file of answers, of which the second is changed."""
    rows = list(map(answer, range(1, 6)))
    rows[1] |= changes
    return json.dumps({"study": "s", "answers": rows})


def films(**changes: Any) -> str:
    """A films.json, of which the first film is changed."""
    film = {"film": 1, "kind": "one part", "parts": ["a"], **changes}
    return json.dumps({"study": "s", "configuration": "limp", "parts": ["a"], "films": [film]})


BLANKS = " " * 6000
MANY = json.dumps({"study": "s", "answers": [answer(1)] * 50_000})
FILES: dict[str, tuple[str, str, Callable[[Path], Any], str]] = {
    "blanks before a link": ("a.txt", f"frames:10\n1-10 {BLANKS}x\n", status, "line 2: 'x' does not read as"),
    "blanks after a link": ("a.txt", f"frames:10\n1-10 A{BLANKS}[\n", status, "line 2: 'A "),
    "blanks in a severity": ("a.txt", f"frames:10\n1-10 A-B[{BLANKS}5\n", status, "line 2: 'A-B["),
    "blanks in a range": ("a.txt", f"frames:10\n1{BLANKS}\n", status, "line 2: '1' does not read as"),
    "a star of 300 joints": ("a.bvh", star(300), clip, "it is in doubt which joints are which parts"),
    "HIERARCHY 2,000 times": (
        "a.bvh",
        "HIERARCHY " * 2000 + star(1)[9:],
        clip,
        "'HIERARCHY' is not known here",
    ),
    "2 million phases": (
        "a.phase",
        "0\n" * 2_000_000,
        lambda path: read_phase(path, SourceTime(200, 60.0), 200),
        "larger than 0.2",
    ),
    "50,000 answers": ("a.json", MANY, answers, "film 1 is answered twice"),
    "a film that is a list": ("a.json", saved(film=[1]), answers, "answer 2: film: "),
    "a film that is true": ("a.json", saved(film=True), answers, "answer 2: film: "),
    "parts that are a number": ("a.json", saved(parts=1), answers, "answer 2: parts: "),
    "a part that is a list": ("a.json", saved(parts=[["a"]]), answers, "answer 2: parts.0: "),
    "a mark that is NaN": ("a.json", saved(fluidity=float("nan")), answers, "not valid JSON: NaN"),
    "a kind that is a list": ("films.json", films(kind=["one part"]), read_study, "films.0.kind: "),
    "a film without a number": ("films.json", films(film=None), read_study, "films.0.film: "),
    "films in a list": ("films.json", "[1]", read_study, "the questionnaire: "),
    "an integer of 20,000 digits": ("a.yaml", "a: 1\nb: " + "9" * 20_000, read_yaml, "line 2: an integer of"),
    "a hexadecimal one": ("a.yaml", "a: 0x" + "f" * 20_000, read_yaml, "line 1: an integer of"),
    "an integer in JSON": ("a.json", "9" * 20_000, read_json, "a.json: not valid JSON"),
    "infinity in JSON": ("a.json", '{"a": [-Infinity]}', read_json, "-Infinity is not a number"),
}


@pytest.mark.parametrize("what", FILES)
def test_it_is_refused_in_seconds(what: str, tmp_path: Path) -> None:
    name, text, read, message = FILES[what]
    path = write(tmp_path / name, text)
    refused(lambda: read(path), name, message, letters=5000)
