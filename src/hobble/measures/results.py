"""Tables of results as pandas data frames, for a notebook. The package `hobble` has the function, too."""

from pathlib import Path

import pandas

from hobble.core.errors import HobbleError
from hobble.core.files import read_yaml
from hobble.report.gather import PUBLISHED


def results(configuration: str, folder: str | Path = "results") -> dict[str, pandas.DataFrame]:
    """Name -> data frame, for each table of results: of a configuration, a comparison or the publications.

    configuration: its name, "compare" for the last comparison, or "published" for published figures. folder:
    the results folder of the workflow. The tables of a configuration are those of its measurements, such as
    "accuracy/clips", and "history", with a row for each section of the training. docs/artefacts.md describes
    their columns. Raises HobbleError if there are no results yet.
    """
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
    found = read_yaml(PUBLISHED)
    lists = {
        name: rows for name, rows in found.items() if isinstance(rows, list) and isinstance(rows[0], dict)
    }
    groups = {name: found[name] for name in ("clip_means", "clip_sds", "laps", "curves")}
    return {name: pandas.DataFrame(rows) for name, rows in {**lists, **groups}.items()}
