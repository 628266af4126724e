"""Hobble: from motion capture to a character controller that limps the way the body would.

    from hobble import load

    character = load("results/injured/network")
    pose = character.next_pose((0, 2.5), injury={"LeftUpLeg-LeftLeg": 7})

`hobble.results` gives tables of results as pandas data frames, for a notebook.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas

    from hobble.runtime.animation import ProceduralAnimation


def load(path: str | Path, **options: Any) -> ProceduralAnimation:
    """Load a trained character. path: the folder `network` of its results, or an exported file.

    options: those of `hobble.runtime.ProceduralAnimation.load`.
    """
    # No `import`: every job of the workflow imports hobble, and would depend on the runtime.
    animation = importlib.import_module("hobble.runtime.animation")
    character: ProceduralAnimation = animation.ProceduralAnimation.load(path, **options)
    return character


def results(configuration: str, folder: str | Path = "results") -> dict[str, pandas.DataFrame]:
    """Name -> data frame, for each table of results: of a configuration, a comparison or the publications.

    configuration: its name, "compare" for the last comparison, or "published" for published figures. folder:
    the results folder of the workflow. The tables of a configuration are those of its measurements, such as
    "accuracy/clips", and "history", with a row for each section of the training. docs/artefacts.md describes
    their columns. Raises HobbleError if there are no results yet.
    """
    import pandas

    from hobble.core.errors import HobbleError

    if configuration == "published":
        return _published()
    base = Path(folder) / configuration
    parts = ["tables"] if configuration == "compare" else ["evaluation", "network"]
    files = {
        str(file.relative_to(base / part).with_suffix("")): file
        for part in parts
        for file in sorted((base / part).rglob("*.csv"))
    }
    if not files:
        raise HobbleError(f"{base} has no tables. Make them: snakemake -c2 {base}/report.html")
    return {name: pandas.read_csv(file) for name, file in files.items() if file.stat().st_size}


def _published() -> dict[str, pandas.DataFrame]:
    """The figures of published.yaml, a data frame for each list and for each group of columns."""
    import pandas

    from hobble.core.files import read_yaml

    # No `import`: every job would depend on the page.
    found = read_yaml(importlib.import_module("hobble.report.gather").PUBLISHED)
    lists = {
        name: rows for name, rows in found.items() if isinstance(rows, list) and isinstance(rows[0], dict)
    }
    groups = {name: found[name] for name in ("clip_means", "clip_sds", "laps", "curves")}
    return {name: pandas.DataFrame(rows) for name, rows in {**lists, **groups}.items()}


def __getattr__(name: str) -> Any:
    """`__version__`, read at its first use, because that is slow."""
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version("hobble")
    raise AttributeError(f"module 'hobble' has no attribute {name!r}")
