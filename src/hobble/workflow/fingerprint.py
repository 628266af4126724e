"""A hash of what a script really runs: its own code and that of every project module it imports."""

from __future__ import annotations

import ast
import functools
import hashlib
from collections.abc import Iterable
from pathlib import Path


def fingerprint(script: Path, source: Path, modules: Iterable[str] = ()) -> str:
    """Hash `script` and its import closure among the packages under `source`.

    modules: full names of modules that the script imports by a name it is told. Comments, blank lines and
    docstrings do not count, so that editing them re-runs nothing.
    """
    digest = hashlib.sha256(_stripped(script).encode())
    for module in sorted(closure(script, source, modules)):
        digest.update(_stripped(module).encode())
    return digest.hexdigest()[:16]


def closure(script: Path, source: Path, modules: Iterable[str] = ()) -> set[Path]:
    """The project files that `script` imports, directly or through others, and `modules` with theirs."""
    found: set[Path] = set()
    waiting = list(_imports(script, source))
    for module in modules:
        waiting += _files_of(module, source)
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += _imports(path, source)
    return found


@functools.cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), filename=str(path))


@functools.cache
def _stripped(path: Path) -> str:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and _is_docstring(body[0]):
            body[0] = ast.Pass()
    return ast.dump(tree)


def _is_docstring(node: ast.stmt) -> bool:
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


@functools.cache
def _imports(path: Path, source: Path) -> frozenset[Path]:
    found: set[Path] = set()
    for node in ast.walk(_tree(path)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names = [node.module] + [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            found |= _files_of(name, source)
    return frozenset(found)


def _files_of(module: str, source: Path) -> set[Path]:
    """The module's file and the `__init__.py` of each package on the way to it."""
    parts = module.split(".")
    files = set()
    for n in range(1, len(parts) + 1):
        here = source.joinpath(*parts[:n])
        for candidate in (here / "__init__.py", here.with_suffix(".py")):
            if candidate.is_file():
                files.add(candidate)
    return files
