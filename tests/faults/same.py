"""Compares artefacts without times; `python -m tests.faults.same FOLDER FOLDER` those of two runs."""

import csv
import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import CHECKSUMS

COMMIT = re.compile(rb"<td>commit</td>.*?</tr>")  # a clone that lies in no repository has none
HISTORY_SECONDS = 3  # the column of a checkpoint's history
# Folders and files of a run that differ; .made has notes of how long each clip took.
OF_THE_RUN = {"logs", "benchmarks", "checkpoints", "page", ".made", "report.html"}


def same(a: Path, b: Path) -> bool:
    """Whether the bytes are equal, in files with times apart from those. Folders: all files in them."""
    if not a.exists() or not b.exists():
        return a.exists() == b.exists()
    if a.is_dir():
        return _files(a) == _files(b) and all(same(a / name, b / name) for name in _files(a))
    if a.read_bytes() == b.read_bytes():
        return True
    if a.name == "pipeline.json":  # all that it holds is what was measured
        return json.loads(a.read_text()).keys() == json.loads(b.read_text()).keys()
    if a.name == "responsivity.json":
        return _untimed(json.loads(a.read_text())) == _untimed(json.loads(b.read_text()))
    if a.name in ("history.csv", "laps.csv"):
        return _rows(a) == _rows(b)
    if a.suffix == ".html":
        return COMMIT.sub(b"", a.read_bytes()) == COMMIT.sub(b"", b.read_bytes())
    return "checkpoint" in a.name and _same_checkpoint(a, b)


def _files(folder: Path) -> list[str]:
    files = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    return sorted(str(path) for path in files if not path.name.startswith("."))


def _untimed(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _untimed(v) for k, v in value.items() if k not in ("milliseconds", CHECKSUMS)}
    return [_untimed(v) for v in value] if isinstance(value, list) else value


def _rows(path: Path) -> list[dict[str, str]]:
    rows = csv.DictReader(path.read_text().splitlines())
    return [{k: v for k, v in row.items() if not k.startswith(("milliseconds", "seconds"))} for row in rows]


def _same_checkpoint(a: Path, b: Path) -> bool:
    with np.load(a) as one, np.load(b) as two:
        pairs = [(name, np.array(one[name]), np.array(two[name])) for name in one.files if name in two.files]
        for name, x, y in pairs:
            if name == "history" and x.shape == y.shape:
                x[:, HISTORY_SECONDS] = y[:, HISTORY_SECONDS] = 0
        return set(one.files) == set(two.files) and all(
            np.array_equal(x, y, equal_nan=x.dtype.kind == "f") for name, x, y in pairs if name != "seconds"
        )


def main(first: str, second: str) -> int:
    """Compare results/ of two runs. Returns 1 if a file differs, or if only one of them has it."""
    runs = [Path(folder, "results") for folder in (first, second)]
    names = {name for run in runs for name in _files(run) if not OF_THE_RUN & set(Path(name).parts)}
    different = sorted(name for name in names if not same(runs[0] / name, runs[1] / name))
    said = f"{len(names)} artefacts are the same, bit for bit"
    print("\n".join(f"differs: {name}" for name in different) or said)
    return int(bool(different or not names))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
