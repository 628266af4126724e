"""The name of a channel may occur only in its own folder, and in what asks for this channel."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from hobble.channels import CHANNEL_NAMES
from hobble.measures.measure import all_measures

SRC = Path(__file__).parents[2] / "src" / "hobble"
# The list of channels, and the generators of hurt motion, which write what one channel reads.
ALLOWED = ("channels/__init__.py", "hurt/", "synthetic/")
# What asks for one channel: its command, its films and their study. Measurements say so in `Measure.channel`.
ENDS = (".py", "_run.py")
ASKING = {
    "injury": (
        *("cli/", "measures/films.py", "measures/study.py"),
        *("measures/recognition.py", "measures/recognition_run.py"),
    ),
    "guarding": ("gait/judge.py", "measures/limp_goals.py", "measures/limp_run.py"),  # who judges limps
}


def words(path: Path) -> Iterator[str]:
    """The text of a script or template. Of Python only names and strings, without docstrings."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        yield text
        return
    tree = ast.parse(text)
    said = {
        id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr) and isinstance(n.value, ast.Constant)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in said:
            yield node.value
        for field in ("id", "attr", "name", "arg", "module"):
            if isinstance(found := getattr(node, field, None), str):
                yield found


@pytest.mark.parametrize("name", CHANNEL_NAMES)
def test_no_file_outside_its_folder_names_a_channel(name: str) -> None:
    asking = [f"measures/{one.name}{end}" for one in all_measures() if one.channel == name for end in ENDS]
    allowed = (f"channels/{name}/", *ALLOWED, *ASKING.get(name, ()), *asking)
    for path in sorted(SRC.rglob("*")):
        at = path.relative_to(SRC).as_posix()
        if path.suffix not in (".py", ".js", ".j2", ".ts") or "node_modules" in at or at.startswith(allowed):
            continue
        for text in words(path):
            assert not re.search(rf"(?<![a-z]){name}(?![a-z])", text, re.IGNORECASE), f"{at}: {text:.100}"
