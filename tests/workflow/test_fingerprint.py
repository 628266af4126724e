"""What counts as a change of a rule's code, and what does not."""

from __future__ import annotations

from pathlib import Path

import pytest

from hobble.measures.measure import Measure, all_measures
from hobble.workflow import fingerprint as fp


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """A script and a package with every kind of text and code."""
    for file, text in {
        "src/pkg/__init__.py": '"""Package."""\n',
        "src/pkg/near.py": "from pkg.far import f\n\ndef g():\n    return f(1)\n",
        "src/pkg/far.py": FAR,
        "src/pkg/options.py": OPTIONS,
        "src/pkg/other.py": "x = 1\n",
        "src/hobble/__init__.py": "",
        "src/hobble/workflow/__init__.py": "",
        "src/hobble/workflow/job.py": "x = 1\n",
        "script.py": "from hobble.workflow.job import x\nfrom pkg import near\nprint(near.g())\n",
    }.items():
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(text)
    return tmp_path


FAR = """
import logging
from pkg.options import Options

log = logging.getLogger("far")
KIND = "walk"


def f(x: int) -> int:
    '''Doc.'''
    # why
    if x > 9:
        raise ValueError(f"{x} is too large")
    log.info("%d comes", x)
    assert x != 7
    return Options(kind=KIND).double() + 1
"""

OPTIONS = """
from pydantic import Field
from hobble.core.section import Section


class Options(Section):
    passes: int = Field(1, description="how often")
    kind: str

    def double(self):
        return 2 * self.passes
"""


def mark(root: Path) -> str:
    for cached in (fp._parse_module, fp._files_of):
        cached.cache_clear()
    return fp.fingerprint(root / "script.py", root / "src")


CHANGES = (
    ("script.py", "near.g()", "near.g() + 1"),
    ("src/pkg/far.py", "x != 7", "x != 8"),
    ("src/pkg/far.py", "raise ValueError(", "print("),
    ("src/pkg/options.py", "2 * self", "3 * self"),
)
HARMLESS = (
    ("src/pkg/far.py", "# why", "# because"),
    ("src/pkg/far.py", "Doc.", "Other words."),
    ("src/pkg/far.py", "is too large", "is more than 9"),
    ("src/pkg/far.py", "%d comes", "here comes %d"),
    ("src/pkg/far.py", "x: int", "x: float"),
    ("src/pkg/options.py", "how often", "times"),
    ("src/pkg/options.py", "kind: str", "kind: str\n    more: int = 3"),
    ("src/pkg/other.py", "x = 1", "x = 2"),
    ("src/hobble/workflow/job.py", "x = 1", "x = 2"),
)


def test_only_code_changes_a_fingerprint(source: Path) -> None:
    for file, old, new in (*HARMLESS, *CHANGES):
        before, path = mark(source), source / file
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))
        assert (mark(source) != before) is ((file, old, new) in CHANGES), (old, new)


def test_motion_depends_on_its_own_room_and_those_before_it(root: Path) -> None:
    files = fp.imported_files(root / "workflow/scripts/motion_clips.py", root / "src")
    rooms = {path.relative_to(root / "src/hobble").parts[0] for path in files}
    assert rooms <= {"__init__.py", "core", "figure", "motion"}


@pytest.mark.parametrize("measure", all_measures(), ids=lambda measure: measure.name)
def test_a_measurement_depends_neither_on_the_page_nor_on_other_measurements(
    root: Path, measure: Measure
) -> None:
    """Otherwise a new measurement or another text on a page would run all measurements again."""
    files = fp.imported_files(root / "workflow/scripts/measure.py", root / "src", [measure.run_module])
    used = {".".join(path.relative_to(root / "src").with_suffix("").parts) for path in files}
    assert measure.run_module in used
    assert not [name for name in used if name.startswith("hobble.report.")]
    assert not used & {one.module for one in all_measures()}
