"""Importing a module of a package hides a function of the package with the same name."""

import ast
from pathlib import Path


def test_no_function_of_a_package_is_hidden_by_a_module(root: Path) -> None:
    """A package may import that module itself before it defines the function."""
    found = []
    for init in (root / "src").rglob("__init__.py"):
        body = ast.parse(init.read_text(encoding="utf-8")).body
        own = {node.name for node in body if isinstance(node, ast.FunctionDef | ast.ClassDef)}
        imported = {
            (node.module or "").rpartition(".")[2] for node in body if isinstance(node, ast.ImportFrom)
        }
        modules = {path.stem for path in init.parent.iterdir() if path.suffix == ".py" or path.is_dir()}
        found += [f"{init.parent.name}.{name}" for name in (own & modules) - imported]
    assert found == []
