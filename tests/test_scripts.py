"""Imports from the package in files that no type checker reads: benchmarks, examples and the workflow."""

import ast
import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SCRIPTS = sorted(ROOT.glob("benchmarks/*.py")) + sorted(ROOT.glob("examples/*.py"))
RULES = [ROOT / "Snakefile", *sorted(ROOT.glob("workflow/rules/*.smk"))]
IMPORT = re.compile(r"^\s*(from hobble\S* import (?:\([^)]*\)|.*))$", re.MULTILINE)


def check_imports(code: str) -> None:
    """Fails if a `from hobble... import` in this Python code names something that does not exist."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("hobble"):
            module = importlib.import_module(node.module or "")
            for name in node.names:
                if not hasattr(module, name.name):
                    importlib.import_module(f"{node.module}.{name.name}")


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_a_script_imports_only_what_the_package_has(script: Path) -> None:
    check_imports(script.read_text(encoding="utf-8"))


@pytest.mark.parametrize("rules", RULES, ids=lambda path: path.name)
def test_a_file_of_rules_imports_only_what_the_package_has(rules: Path) -> None:
    """Files of rules are not Python as a whole, but their imports are."""
    importlib.import_module("snakemake.api")  # its modules import each other, and only this order works
    for line in IMPORT.findall(rules.read_text(encoding="utf-8")):
        check_imports(line)


def test_a_missing_name_is_found() -> None:
    [line] = IMPORT.findall("x = 1\nfrom hobble.workflow.project import (\n    Project,\n    Nothing,\n)\n")
    with pytest.raises(ModuleNotFoundError, match="Nothing"):
        check_imports(line)
