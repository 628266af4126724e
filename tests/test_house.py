"""The shape of the house: a room imports only from rooms before it, and modules do not import in circles."""

import ast
from collections.abc import Iterator, Mapping, Set
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

# The rooms of src/hobble, in the order in which data passes through them.
ROOMS = (
    *("core", "figure", "motion", "labels", "gait", "synthetic", "channels", "hurt", "terrain", "rows"),
    *("models", "runtime", "engine", "database", "training", "report", "measures", "config", "workflow"),
    "cli",
)


def modules_of(source: Path) -> dict[str, Path]:
    """Full name of each module below `source` -> its file."""
    found = {}
    for file in (source / "hobble").rglob("*.py"):
        parts = file.relative_to(source).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


def imports_of(file: Path, modules: Set[str]) -> Iterator[str]:
    """The modules of the house that a file imports anywhere in it, also in functions."""
    for node in ast.walk(ast.parse(file.read_text())):
        names = [alias.name for alias in getattr(node, "names", ())]
        if isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{name}" for name in names] + [str(node.module)]
            names = names[:-1] if names[0] in modules else names  # a package is not imported for its modules
        if isinstance(node, ast.ImportFrom | ast.Import):
            yield from (name for name in names if name in modules)


def upward_arrows(imports: Mapping[str, Set[str]]) -> list[str]:
    """The imports of a module from a room that comes after its own."""
    return [
        f"{module} imports {imported}"
        for module, all_imported in sorted(imports.items())
        for imported in sorted(all_imported)
        if "." in module and "." in imported and _floor(imported) > _floor(module)
    ]


def _floor(module: str) -> int:
    room = module.split(".")[1]
    return ROOMS.index(room) if room in ROOMS else len(ROOMS)


@pytest.fixture(scope="module")
def imports(root: Path) -> dict[str, set[str]]:
    """Module -> the modules that it imports."""
    modules = modules_of(root / "src")
    return {name: set(imports_of(file, modules.keys())) - {name} for name, file in modules.items()}


def test_every_room_has_its_place(root: Path) -> None:
    folders = {path.name for path in (root / "src/hobble").iterdir() if (path / "__init__.py").exists()}
    assert folders == set(ROOMS)


def test_no_room_imports_from_a_later_one(imports: dict[str, set[str]]) -> None:
    assert upward_arrows(imports) == []


def test_modules_do_not_import_in_circles(imports: dict[str, set[str]]) -> None:
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_a_wrong_arrow_and_a_circle_are_seen(tmp_path: Path) -> None:
    for name, text in {
        "core/a": "from hobble.models.b import x\n",
        "models/b": "def f():\n    from hobble.core import a\n",
    }.items():
        (tmp_path / "hobble" / name).parent.mkdir(parents=True)
        (tmp_path / "hobble" / name).with_suffix(".py").write_text(text)
    modules = modules_of(tmp_path)
    found = {name: set(imports_of(file, modules.keys())) for name, file in modules.items()}
    assert upward_arrows(found) == ["hobble.core.a imports hobble.models.b"]
    with pytest.raises(CycleError):
        TopologicalSorter(found).prepare()
