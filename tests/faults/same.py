"""Compares artefacts without times; `python -m tests.faults.same FOLDER FOLDER` those of two runs."""

from __future__ import annotations

import csv
import io
import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import CHECKSUMS

TIMED = {
    "responsivity.json": {"milliseconds"},
}
COMMIT = re.compile(rb"<td>commit</td>.*?</tr>")  # a clone that lies in no repository has none
HISTORY_SECONDS = 3  # the column of a checkpoint's history


def same(a: Path, b: Path) -> bool:
    """Whether the bytes are equal, in files with times apart from those. Folders: all files in them."""
    if not a.exists() or not b.exists():
        return a.exists() == b.exists()
    if a.name == "pipeline.json":  # all that it holds is what was measured
        return json.loads(a.read_text()).keys() == json.loads(b.read_text()).keys()
    if a.is_dir():
        return _files(a).keys() == _files(b).keys() and all(same(f, b / n) for n, f in _files(a).items())
    if a.read_bytes() == b.read_bytes():
        return True
    if a.name in TIMED:
        return _untimed(json.loads(a.read_text()), TIMED[a.name]) == _untimed(
            json.loads(b.read_text()), TIMED[a.name]
        )
    if a.name in ("history.csv", "laps.csv"):
        return _rows(a) == _rows(b)
    if a.suffix == ".html":
        return COMMIT.sub(b"", a.read_bytes()) == COMMIT.sub(b"", b.read_bytes())
    if "checkpoint" in a.name:
        return _checkpoint(a, b)
    return False


def _files(folder: Path) -> dict[str, Path]:
    files = (path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))
    return {str(path.relative_to(folder)): path for path in files}


def _untimed(value: Any, names: set[str]) -> Any:
    if isinstance(value, dict):
        return {k: _untimed(v, names) for k, v in value.items() if k not in {*names, CHECKSUMS}}
    return [_untimed(v, names) for v in value] if isinstance(value, list) else value


def _rows(path: Path) -> list[dict[str, str]]:
    rows = csv.DictReader(io.StringIO(path.read_text()))
    timed = ("milliseconds",) if path.name == "laps.csv" else ("seconds",)
    return [{k: v for k, v in row.items() if not k.startswith(timed)} for row in rows]


def _checkpoint(a: Path, b: Path) -> bool:
    with np.load(a) as one, np.load(b) as two:
        if set(one.files) != set(two.files):
            return False
        for name in set(one.files) - {"seconds"}:
            x, y = (np.array(file[name]) for file in (one, two))
            if name == "history" and x.shape == y.shape:
                x[:, HISTORY_SECONDS] = y[:, HISTORY_SECONDS] = 0
            if not np.array_equal(x, y, equal_nan=x.dtype.kind == "f"):
                return False
    return True


# .made has notes of how long each clip took.
OF_THE_RUN = {"logs", "benchmarks", "checkpoints", "page", ".made", "report.html"}


def main(first: str, second: str) -> int:
    """Compare results/ of two runs. Returns 1 if a file differs, or if only one of them has it."""
    runs = [Path(folder, "results") for folder in (first, second)]
    names = {str(file.relative_to(run)) for run in runs for file in run.rglob("*") if file.is_file()}
    names = {name for name in names if not Path(name).name.startswith(".")}
    names = {name for name in names if not OF_THE_RUN & set(Path(name).parts)}
    different = sorted(name for name in names if not same(runs[0] / name, runs[1] / name))
    said = f"{len(names)} artefacts are the same, bit for bit"
    print("\n".join(f"differs: {name}" for name in different) or said)
    return int(bool(different or not names))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
