"""What counts as a change of a rule's code, and what does not."""

from __future__ import annotations

from pathlib import Path

import pytest

from hobble.measures.measure import Measure
from hobble.measures.registry import MEASURES
from hobble.workflow import fingerprint as fp
from hobble.workflow.costs import OF_DATASET


@pytest.fixture
def source(tmp_path: Path) -> Path:
    package = tmp_path / "src" / "pkg"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text('"""Package."""\n')
    (package / "near.py").write_text("from pkg.far import f\n\ndef g():\n    return f()\n")
    (package / "far.py").write_text('def f():\n    """Doc."""\n    # why\n    return 1\n')
    (package / "other.py").write_text("x = 1\n")
    (tmp_path / "script.py").write_text("from pkg import near\nprint(near.g())\n")
    return tmp_path


def mark(root: Path) -> str:
    for cached in (fp._tree, fp._stripped, fp._imports):
        cached.cache_clear()
    return fp.fingerprint(root / "script.py", root / "src")


def test_the_closure_follows_imports_through_modules(source: Path) -> None:
    names = {path.name for path in fp.closure(source / "script.py", source / "src")}
    assert names == {"__init__.py", "near.py", "far.py"}


@pytest.mark.parametrize(
    ("file", "old", "new", "changes"),
    [
        ("src/pkg/far.py", "return 1", "return 2", True),
        ("script.py", "near.g()", "near.g() + 1", True),
        ("src/pkg/far.py", "# why", "# because", False),
        ("src/pkg/far.py", "Doc.", "Other words.", False),
        ("src/pkg/other.py", "x = 1", "x = 2", False),
    ],
)
def test_code_counts_comments_do_not(source: Path, file: str, old: str, new: str, changes: bool) -> None:
    before = mark(source)
    path = source / file
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    assert (mark(source) != before) is changes


def test_no_job_depends_on_the_configuration_models(root: Path) -> None:
    """Else a new key in one section would re-run every rule."""
    for script in (root / "workflow/scripts").glob("*.py"):
        if script.stem == "configuration":  # writes the resolved configuration itself
            continue
        modules = {p.parent.name for p in fp.closure(script, root / "src")}
        assert "config" not in modules, script.name


def test_no_stage_imports_from_below(root: Path) -> None:
    order = [*OF_DATASET, "training", "runtime", "evaluation", "report"]
    order.insert(order.index("database"), "rows")
    measures = {root / "src" / one.package.replace(".", "/") for one in MEASURES}
    for rank, stage in enumerate(order):
        for module in (root / "src/hobble" / stage).rglob("*.py"):
            if module.parent in measures:  # what a channel measures of the character comes after all of them
                continue
            for path in fp._imports(module, root / "src"):
                used = path.relative_to(root / "src/hobble").parts[0]
                assert used not in order[rank + 1 :], f"{module.name} of {stage} imports {used}"


@pytest.mark.parametrize("measure", MEASURES, ids=lambda measure: measure.name)
def test_a_measurement_depends_neither_on_the_page_nor_on_the_list(root: Path, measure: Measure) -> None:
    """Else a new measurement, or another word on a page, would measure everything again."""
    files = fp.closure(root / "workflow/scripts/measure.py", root / "src", [measure.module("run")])
    used = {path.relative_to(root / "src/hobble").as_posix() for path in files}
    assert "measures/registry.py" not in used
    assert not [path for path in used if path.startswith("report/")]
    folder = (root / "src" / measure.package.replace(".", "/")).relative_to(root / "src/hobble").as_posix()
    assert f"{folder}/run.py" in used
