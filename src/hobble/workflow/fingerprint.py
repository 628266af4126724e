"""A hash of a rule's code: its script and every project module that the script imports.

The hash ignores what cannot change a result: comments, docstrings, annotations of functions, the text of
errors and log messages, descriptions of options, and the modules of `INFRASTRUCTURE`. It also ignores the
fields of configuration sections, because their values are params of the rules.
"""

from __future__ import annotations

import ast
import functools
import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

# Modules or packages that cannot change a result, and why. A change in them re-runs nothing.
INFRASTRUCTURE = {
    "hobble.config": "its values are params of the rules",
    "hobble.workflow": "runs jobs and answers the Snakefile",
    "hobble.core.errors": "only the wording of errors",
    "hobble.core.files": "a file is read back as it was written, or refused",
    "hobble.core.section": "checks the configuration before any job",
    "hobble.core.untrusted": "only limits what is read",
}
# Calls such as logger.info(...) are not hashed. These are the names of loggers and of their methods.
LOGGERS = {"log", "logger", "logging", "warnings"}
LOG_METHODS = {"debug", "info", "warning", "error", "exception", "critical", "warn"}
NOT_HASHED = {"__future__", "collections.abc", "logging", "typing", "warnings"}  # imports that are not hashed


def fingerprint(script: Path, source: Path, modules: Iterable[str] = ()) -> str:
    """Hash `script` and all modules in folder `source` that it imports, directly or through others.

    modules: full names of modules that the script imports dynamically.
    """
    files = [_module(path, source) for path in (script, *sorted(closure(script, source, modules)))]
    used = frozenset().union(*(file.names for file in files))
    digest = hashlib.sha256()
    for module in files:
        digest.update(module.digest)
        for name, text in module.texts:
            if name in used:  # otherwise only messages use it
                digest.update(f"{name}={text}".encode())
    return digest.hexdigest()[:16]


def closure(script: Path, source: Path, modules: Iterable[str] = ()) -> set[Path]:
    """The project files that `script` and `modules` import, directly or through others.

    The modules of INFRASTRUCTURE are left out.
    """
    files = {path for module in modules for path in _files_of(module, source)}
    waiting = [script, *files]
    while waiting:
        new = set(_module(waiting.pop(), source).imports) - files
        files |= new
        waiting += new
    return files


@dataclass(frozen=True)
class _Module:
    """What the fingerprint needs of a module.

    digest: hash of its code without string constants. texts: (name, value) of its string constants,
    which are hashed only if code other than messages uses them. names: the names that its code uses. imports:
    the project files that it imports.
    """

    digest: bytes
    texts: tuple[tuple[str, str], ...]
    names: frozenset[str]
    imports: frozenset[Path]


@functools.cache
def _module(path: Path, source: Path) -> _Module:
    bare = _Bare()
    tree = bare.visit(ast.parse(path.read_text(encoding="utf-8"), filename=str(path)))
    texts, code = [], []
    for node in tree.body:
        if (constant := _text(node)) is not None:
            texts.append(constant)
        else:
            code.append(ast.dump(node))
    imports = {file for name in bare.imported for file in _files_of(name, source)}
    return _Module(
        hashlib.sha256("\n".join(code).encode()).digest(),
        tuple(texts),
        frozenset(bare.names),
        frozenset(imports),
    )


class _Bare(ast.NodeTransformer):
    """Removes what cannot change a result. Collects the names and the imports of the remaining code."""

    def __init__(self) -> None:
        self.names: set[str] = set()
        self.imported: set[str] = set()

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if isinstance(node.ctx, ast.Load):
            self.names.add(node.id)
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        self.names.add(node.attr)
        return self.generic_visit(node)

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        value = node.value
        if isinstance(value, ast.Constant) and isinstance(value.value, str):
            return ast.Pass()  # a docstring
        if isinstance(value, ast.Call) and isinstance(value.func, ast.Attribute):
            logger = value.func.value
            if value.func.attr in LOG_METHODS and isinstance(logger, ast.Name) and logger.id in LOGGERS:
                return ast.Pass()
        return self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        name = _name(node.func)
        if name.endswith("Error"):
            return ast.Call(node.func, [], [])
        if name == "Field":
            node.keywords = [keyword for keyword in node.keywords if keyword.arg != "description"]
        return self.generic_visit(node)

    def visit_Assert(self, node: ast.Assert) -> ast.AST:
        node.msg = None
        return self.generic_visit(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        if any(_name(base) == "Section" for base in node.bases):
            node.body = [part for part in node.body if not isinstance(part, ast.AnnAssign)] or [ast.Pass()]
        return self.generic_visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.returns = None
        return self.generic_visit(node)

    def visit_arg(self, node: ast.arg) -> ast.AST:
        node.annotation = None
        return node

    def visit_If(self, node: ast.If) -> ast.AST:
        return ast.Pass() if _name(node.test) == "TYPE_CHECKING" else self.generic_visit(node)

    def visit_Import(self, node: ast.Import) -> ast.AST:
        names = [alias.name for alias in node.names]
        self.imported.update(name for name in names if not _is_infrastructure(name))
        return node

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST:
        module = node.module or ""
        if module in NOT_HASHED or _is_infrastructure(module):
            return ast.Pass()
        if not node.level:
            full = [f"{module}.{alias.name}" for alias in node.names]
            self.imported.update(name for name in (module, *full) if not _is_infrastructure(name))
            node.names = [alias for alias in node.names if not _is_infrastructure(f"{module}.{alias.name}")]
        return node if node.names else ast.Pass()


def _name(node: ast.AST) -> str:
    """The last part of a dotted name, or "" for anything else."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def _text(node: ast.stmt) -> tuple[str, str] | None:
    """Name and value of a module's string constant, or None for other statements."""
    if isinstance(node, ast.Assign) and len(node.targets) == 1 and isinstance(node.targets[0], ast.Name):
        if isinstance(node.value, ast.JoinedStr):
            return node.targets[0].id, ast.dump(node.value)
        if isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            return node.targets[0].id, node.value.value
    return None


def _is_infrastructure(module: str) -> bool:
    return any(module == name or module.startswith(f"{name}.") for name in INFRASTRUCTURE)


@functools.cache
def _files_of(module: str, source: Path) -> tuple[Path, ...]:
    return tuple(_files_of_module(module, source))


def _files_of_module(module: str, source: Path) -> Iterator[Path]:
    """The module's file and the `__init__.py` of each package on the way to it."""
    parts = module.split(".")
    for n in range(1, len(parts) + 1):
        here = source.joinpath(*parts[:n])
        for candidate in (here / "__init__.py", here.with_suffix(".py")):
            if candidate.is_file():
                yield candidate
