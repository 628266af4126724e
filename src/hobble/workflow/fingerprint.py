"""Computes hashes of what Snakemake does not compare: the code of a rule, and the content of a user's file.

The code is the rule's script and every project module that the script imports. Snakemake runs a rule's jobs
again if the hash changes. So the hash ignores what cannot change a result: comments, docstrings, annotations
of functions, the text of errors and log messages, and the modules of `INFRASTRUCTURE`. It also ignores the
fields of configuration sections, because their values are params of the rules, and Snakemake compares these
itself.

Snakemake compares the times of files: it does not see another file with an older time (`cp -p`). So the rules
that read the user's files have their hashes as a param. A file is hashed again only if its size, times or
inode have changed. Nobody can set the time of its last change of any kind (ctime) back.
"""

from __future__ import annotations

import ast
import atexit
import contextlib
import functools
import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path

from hobble.core.errors import HobbleError
from hobble.core.files import write_text

# Modules and packages that cannot change a result -> the reason. A change in them re-runs nothing.
INFRASTRUCTURE = {
    "hobble.config": "its values are params of the rules",
    "hobble.workflow": "tells the Snakefile which jobs there are, and runs them",
    "hobble.core.errors": "decides only the wording of errors",
    "hobble.core.files": "only limits what is read, and reads a file back as it was written, or refuses it",
    "hobble.core.section": "checks the configuration before any job runs",
}
# Calls such as logger.info(...) are not hashed.
LOGGERS = {"log", "logger", "logging", "warnings"}
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

    def visit(self, node: ast.AST) -> ast.AST:
        """The node without what cannot change a result."""
        match node:
            case ast.Expr(ast.Constant(str())) | ast.If(ast.Name("TYPE_CHECKING")):
                return ast.Pass()  # a docstring, or imports for a type checker
            case ast.Expr(ast.Call(ast.Attribute(ast.Name(logger)))) if logger in LOGGERS:
                return ast.Pass()
            case ast.Call(ast.Name(error)) if error.endswith("Error"):
                return ast.Call(node.func, [], [])  # without the message
            case ast.Assert():
                node.msg = None
            case ast.FunctionDef():
                node.returns = None
            case ast.arg():
                node.annotation = None
            case ast.ClassDef(bases=[ast.Name("Section"), *_]):  # a configuration section
                kept = [statement for statement in node.body if not isinstance(statement, ast.AnnAssign)]
                node.body = kept or [ast.Pass()]
            case ast.Import():
                self._note(alias.name for alias in node.names)
            case ast.ImportFrom():
                return self._imported_from(node)
        return self.generic_visit(node)

    def _imported_from(self, node: ast.ImportFrom) -> ast.AST:
        module = node.module or ""
        if module in NOT_HASHED or _is_infrastructure(module):
            return ast.Pass()
        self._note([module, *(f"{module}.{alias.name}" for alias in node.names)])
        node.names = [alias for alias in node.names if not _is_infrastructure(f"{module}.{alias.name}")]
        return node if node.names else ast.Pass()

    def _note(self, names: Iterable[str]) -> None:
        self.imported.update(name for name in names if not _is_infrastructure(name))


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
    files = [path for here in heres for path in (here / "__init__.py", here.with_suffix(".py"))]
    return tuple(filter(Path.is_file, files))


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


# The content of the user's files.


KNOWN = Path(".snakemake/hobble-contents.json")  # path of a file -> [its stamp, its hash]


def stamp(path: str | Path) -> list[int]:
    """Size, times of the last change of content and of any kind (ns), and inode of a file."""
    status = os.stat(path)
    return [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]


class Contents:
    """The hashes of the user's files. made: the folder of files that are downloaded, which have checksums."""

    def __init__(self, made: Path, known: Path = KNOWN) -> None:
        self.made, self.file = f"{made}/", known
        self.known: dict[str, list] = {}
        self.changed = False
        atexit.register(self.keep)
        with contextlib.suppress(OSError, ValueError):
            found = json.loads(known.read_text(encoding="utf-8"))
            self.known = found if isinstance(found, dict) else {}

    def of(self, paths: Iterable[str]) -> list[str]:
        """Path and hash of each of these files that the user gives, for a rule's params."""
        given = [path for path in map(str, paths) if not path.startswith(("results/", self.made))]
        return [f"{path} {self._hash(path)}" for path in given if os.path.isfile(path)]

    def keep(self) -> None:
        """Write the hashes, for the next run."""
        if self.changed:
            with contextlib.suppress(HobbleError):  # a folder that cannot be written
                write_text(self.file, json.dumps(self.known))

    def _hash(self, path: str) -> str:
        try:
            now = stamp(path)
            if path not in self.known or self.known[path][0] != now:
                with open(path, "rb") as file:
                    digest = hashlib.file_digest(file, "sha256").hexdigest()[:16]
                self.known[path], self.changed = [now, digest], True
            return str(self.known[path][1])
        except (OSError, LookupError, TypeError):
            return "cannot be read"  # no error here: the job that reads the file says why
