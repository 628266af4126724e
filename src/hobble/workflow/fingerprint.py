"""Computes a hash of a rule's code: its script and every project module that the script imports.

Snakemake runs a rule's jobs again if the hash changes. So the hash ignores what cannot change a result:
comments, docstrings, annotations of functions, the text of errors and log messages, and the modules of
`INFRASTRUCTURE`. It also ignores the fields of configuration sections, because their
values are params of the rules, and Snakemake compares these itself.
"""

from __future__ import annotations

import ast
import functools
import hashlib
from collections.abc import Iterable
from pathlib import Path

# Modules and packages that cannot change a result -> the reason. A change in them re-runs nothing.
INFRASTRUCTURE = {
    "hobble.config": "its values are params of the rules",
    "hobble.workflow": "tells the Snakefile which jobs there are, and runs them",
    "hobble.core.errors": "decides only the wording of errors",
    "hobble.core.files": "only limits what is read, and reads a file back as it was written, or refuses it",
    "hobble.core.section": "checks the configuration before any job runs",
}
# Calls such as logger.info(...) are not hashed. LOGGERS are names of loggers, LOG_METHODS those of methods.
LOGGERS = {"log", "logger", "logging", "warnings"}
LOG_METHODS = {"debug", "info", "warning", "error", "exception", "critical", "warn"}
# Lines `from MODULE import ...` with these modules are not hashed.
NOT_HASHED = {"__future__", "collections.abc", "logging", "typing", "warnings"}


def fingerprint(script: Path, source: Path, modules: Iterable[str] = ()) -> str:
    """The hash, 16 hex digits, of `script` and of all project modules that it imports.

    A module counts, too, if another imported module imports it. source: the folder of the project's packages.
    modules: full names of modules that the script imports dynamically.
    """
    digest = hashlib.sha256()
    for path in (script, *sorted(imported_files(script, source, modules))):
        digest.update(_parse_module(path, source)[0])
    return digest.hexdigest()[:16]


def imported_files(script: Path, source: Path, modules: Iterable[str] = ()) -> set[Path]:
    """The files of `modules`, and the project files that `script` and `modules` import.

    The files that these import are included, too, and so on. Left out are the script itself and imported
    modules of INFRASTRUCTURE. The arguments are those of `fingerprint`.
    """
    files = {path for module in modules for path in _files_of(module, source)}
    unread = [script, *files]
    while unread:
        new = _parse_module(unread.pop(), source)[1] - files
        files |= new
        unread += new
    return files


@functools.cache
def _parse_module(path: Path, source: Path) -> tuple[bytes, frozenset[Path]]:
    """The hash of a module's code, and the project files that it imports."""
    remover = _Remover()
    tree = remover.visit(ast.parse(path.read_text(encoding="utf-8"), filename=str(path)))
    imports = {file for name in remover.imported for file in _files_of(name, source)}
    return hashlib.sha256(ast.dump(tree).encode()).digest(), frozenset(imports)


class _Remover(ast.NodeTransformer):
    """Removes what cannot change a result. Collects the imports of the remaining code."""

    def __init__(self) -> None:
        self.imported: set[str] = set()  # full names of what is imported: modules, and objects in them

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
        if _last_name(node.func).endswith("Error"):
            return ast.Call(node.func, [], [])  # without the message
        return self.generic_visit(node)

    def visit_Assert(self, node: ast.Assert) -> ast.AST:
        node.msg = None
        return self.generic_visit(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        if any(_last_name(base) == "Section" for base in node.bases):  # a configuration section
            kept = [statement for statement in node.body if not isinstance(statement, ast.AnnAssign)]
            node.body = kept or [ast.Pass()]
        return self.generic_visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.returns = None
        return self.generic_visit(node)

    def visit_arg(self, node: ast.arg) -> ast.AST:
        node.annotation = None
        return node

    def visit_If(self, node: ast.If) -> ast.AST:
        return ast.Pass() if _last_name(node.test) == "TYPE_CHECKING" else self.generic_visit(node)

    def visit_Import(self, node: ast.Import) -> ast.AST:
        names = [alias.name for alias in node.names]
        self.imported.update(name for name in names if not _is_infrastructure(name))
        return node

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST:
        module = node.module or ""
        if module in NOT_HASHED or _is_infrastructure(module):
            return ast.Pass()
        if not node.level:  # not a relative import
            full = [f"{module}.{alias.name}" for alias in node.names]
            self.imported.update(name for name in (module, *full) if not _is_infrastructure(name))
            node.names = [alias for alias in node.names if not _is_infrastructure(f"{module}.{alias.name}")]
        return node if node.names else ast.Pass()


def _last_name(node: ast.AST) -> str:
    """The last part of a dotted name; "" if the node is not a name."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def _is_infrastructure(module: str) -> bool:
    """Whether a module, given by its full name, is in INFRASTRUCTURE or in a package listed there."""
    return any(module == name or module.startswith(f"{name}.") for name in INFRASTRUCTURE)


@functools.cache
def _files_of(module: str, source: Path) -> tuple[Path, ...]:
    """The module's file, and the `__init__.py` of each package that contains it.

    Empty for a module outside `source`. For an object in a module, the module's files.
    """
    parts = module.split(".")
    heres = [source.joinpath(*parts[:n]) for n in range(1, len(parts) + 1)]
    candidates = [path for here in heres for path in (here / "__init__.py", here.with_suffix(".py"))]
    return tuple(path for path in candidates if path.is_file())


class Package:
    """The package `hobble` in a checkout of the repository. base: the folder of the checkout."""

    def __init__(self, base: Path) -> None:
        self.base = base
        self.folder = base / "src" / "hobble"

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def code(self, script: str, *modules: str) -> str:
        """Hash of a rule's script and of everything that the script imports from the package.

        script: its name, without .py. modules: full names of modules that the script imports dynamically.
        """
        path = self.base / "workflow" / "scripts" / f"{script}.py"
        return fingerprint(path, self.base / "src", modules)

    def files(self, *patterns: str) -> list[str]:
        """Paths of the package's files that match patterns, such as "report/web/*.js", in a fixed order."""
        files = [path for pattern in patterns for path in self.folder.glob(pattern) if path.is_file()]
        return sorted(str(path) for path in files if "__pycache__" not in path.parts)
