"""Imports from the package in files that no type checker reads: benchmarks, examples and the workflow."""

import ast
import importlib
import re
from pathlib import Path

import pytest

from tests.conftest import ROOT

PLACES = ("benchmarks/*.py", "examples/*.py", "workflow/scripts/*.py", "Snakefile", "workflow/rules/*.smk")
FILES = [path for place in PLACES for path in sorted(ROOT.glob(place))]
IMPORT = re.compile(r"^\s*(from hobble\S* import (?:\([^)]*\)|.*))$", re.MULTILINE)


@pytest.mark.parametrize("file", FILES, ids=lambda path: path.name)
def test_a_file_imports_only_what_the_package_has(file: Path) -> None:
    """Files of rules are not Python as a whole, but their imports are."""
    importlib.import_module("snakemake.api")  # its modules import each other, and only this order works
    code = "\n".join(IMPORT.findall(file.read_text(encoding="utf-8")))
    for node in ast.parse(code).body:
        assert isinstance(node, ast.ImportFrom)
        module = importlib.import_module(node.module or "")
        for name in node.names:
            if not hasattr(module, name.name):
                importlib.import_module(f"{node.module}.{name.name}")
