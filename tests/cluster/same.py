"""Checks that two runs have the same results: same.py FOLDER FOLDER compares their results/ folders."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path
from typing import Any

# .made has notes of how long each clip took.
OF_THE_RUN = {"logs", "benchmarks", "checkpoints", "page", "checksums", ".made"}
ACCOUNTS = {"pipeline.json", "report.html", "checkpoint.npz"}


def artefacts(run: Path) -> dict[str, Path]:
    """Name -> file, for every file that must be the same."""
    results = run / "results"
    files = {str(p.relative_to(results)): p for p in sorted(results.rglob("*")) if p.is_file()}
    return {
        name: path
        for name, path in files.items()
        if not OF_THE_RUN & set(Path(name).parts) and path.name not in ACCOUNTS
    }


def content(path: Path) -> Any:
    """The part of a file that must be the same."""
    if path.suffix == ".json":
        return without_times(json.loads(path.read_text()))
    if path.suffix == ".csv":
        with open(path, newline="") as file:
            return [
                {k: v for k, v in row.items() if k != "seconds" and "milliseconds" not in k}
                for row in csv.DictReader(file)
            ]
    return path.read_bytes()


def without_times(value: Any) -> Any:
    """A JSON value without the values of `milliseconds`."""
    if isinstance(value, dict):
        return {k: without_times(v) for k, v in value.items() if k != "milliseconds"}
    return [without_times(v) for v in value] if isinstance(value, list) else value


def differences(first: Path, second: Path) -> list[str]:
    """Files that only one of the runs has, and files that differ."""
    a, b = artefacts(first), artefacts(second)
    one_sided = sorted(a.keys() ^ b.keys())
    return one_sided + [name for name in sorted(a.keys() & b.keys()) if content(a[name]) != content(b[name])]


if __name__ == "__main__":
    runs = [Path(argument) for argument in sys.argv[1:]]
    different, count = differences(*runs), len(artefacts(runs[0]))
    same = f"{count} artefacts are the same, bit for bit"
    print("\n".join(f"differs: {name}" for name in different) or same)
    sys.exit(bool(different or not count))
