"""How a result was made: versions, commit and machine, and the time, memory and disk space of each stage.

Time and memory are from Snakemake's benchmark files, disk space from the sizes of the artefacts.
"""

from __future__ import annotations

import csv
import json
import os
import platform
import subprocess
from collections import defaultdict
from collections.abc import Container, Iterable, Iterator, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

from hobble.core.errors import InputError
from hobble.core.files import read_json, read_numbers
from hobble.core.processors import processor_name
from hobble.database.chunks import FILE as MANIFEST
from hobble.database.chunks import Manifest, database_sizes

WEB = Path(__file__).parent / "web"  # the page's scripts
# The Python packages whose versions are reported.
PACKAGES = ("hobble", "torch", "numpy", "scipy", "numba", "snakemake", "pydantic", "jinja2")


def versions() -> dict[str, str]:
    """Name -> version, for Python, the main Python packages and the page's npm packages."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found | json.loads((WEB / "package.json").read_text(encoding="utf-8"))["dependencies"]


def machine() -> dict[str, Any]:
    """System, processor, cores and memory of this machine, but not the name of the host or the user."""
    try:
        memory_gb = round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9, 1)
    except (ValueError, OSError, AttributeError):
        memory_gb = None
    return {
        "system": f"{platform.system()} {platform.machine()}",
        "processor": processor_name(),
        "cores": os.cpu_count(),
        "memory_gb": memory_gb,
    }


def git_commit(folder: Path) -> dict[str, Any] | None:
    """The hash of the commit that is checked out at `folder`, and whether tracked files differ from it.

    None if `folder` is not in a git checkout, or if git is not installed.
    """

    def git(*arguments: str) -> str:
        command = ["git", "-C", str(folder), "--no-optional-locks", *arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10)
        return done.stdout.strip()

    try:
        changes = git("status", "--porcelain", "--untracked-files=no")
        return {"commit": git("rev-parse", "HEAD"), "changed": bool(changes)}
    except (OSError, subprocess.SubprocessError):
        return None


def summarise_pipeline(
    configuration: str,
    stages: Mapping[str, Mapping[str, Iterable[str]]],
) -> dict[str, Any]:
    """The content of `pipeline.json`.

    stages: in the order of the pipeline, stage -> a dict with the keys

    - "benchmarks": tsv files or folders of them;
    - "files": artefacts or folders of them;
    - "made", only for stages that make the clips of a data set in batches: for each rule with batches, a
      folder that is named after the rule and has a record of each finished clip;
    - "batches", only for these stages: the names of the benchmarks of all present batches. For a rule in
      "made", other benchmarks do not count. They are left from batches that have changed since, for example
      because a clip was added.

    A missing file is listed under `missing`. It is no error, because a stage may have been copied from
    another machine without its benchmarks.

    If a job was stopped and started again, its benchmark covers only the last start. Its true time is also in
    the history of training (history.csv), or in the records in "made". The longer of both times counts.

    The result has `stages` (for each stage: jobs, seconds, `longest` job in seconds, max_rss_mb, cpu_seconds,
    files, bytes; and `rules`, which has the same for each rule, but not files and bytes), `total_seconds`,
    `total_bytes`, `database` (see `hobble.database.chunks`; None without a database), `missing`, `machine`,
    `versions`. Raises InputError for a malformed benchmark or history.
    """
    missing: list[str] = []
    entries: list[dict[str, Any]] = []
    for stage, paths in stages.items():
        clip_seconds = {
            Path(folder).name: _recorded_seconds(Path(folder)) for folder in paths.get("made", ())
        }
        by_rule = _read_jobs(
            paths.get("benchmarks", ()), missing, clip_seconds, set(paths.get("batches", ()))
        )
        for row in by_rule.get("training", ()):
            row["s"] = max(row.get("s", 0.0), _training_seconds(paths.get("files", ())))
        for rule, seconds in clip_seconds.items():
            _scale_times(by_rule[rule], seconds)
        file_sizes = _file_sizes(paths.get("files", ()), missing)
        total = _total_of_jobs([row for rows in by_rule.values() for row in rows])
        rules = [{"rule": rule, **_total_of_jobs(rows)} for rule, rows in sorted(by_rule.items()) if rows]
        sizes = {"files": len(file_sizes), "bytes": sum(file_sizes)}
        entries.append({"stage": stage, **total, **sizes, "rules": rules})
    databases = [Path(p) for p in stages.get("database", {}).get("files", ()) if Path(p, MANIFEST).is_file()]
    return {
        "configuration": configuration,
        "stages": entries,
        "total_seconds": round(sum(entry["seconds"] for entry in entries), 3),
        "total_bytes": sum(entry["bytes"] for entry in entries),
        "database": database_sizes(Manifest.load(databases[0])) if databases else None,
        "missing": sorted(missing),
        "machine": machine(),
        "versions": versions(),
    }


def _recorded_seconds(folder: Path) -> float:
    """How many seconds it took to make the clips of a rule, from the records in its folder."""
    return sum(float(read_json(path)["seconds"]) for path in folder.rglob("*.json"))


def read_benchmark(path: str | Path) -> list[dict[str, float]]:
    """The rows of a Snakemake benchmark file: column -> value. There is a row for each run of the job.

    Values that were not measured ("-", "NA") are left out. Raises InputError if the file is not a benchmark.
    """
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file, delimiter="\t"))
    if rows and "s" not in rows[0]:
        raise InputError(path, "not a Snakemake benchmark: it has no column `s`", fix="Delete it.")
    return [
        {key: number for key, text in row.items() if (number := _number(text)) is not None} for row in rows
    ]


def _number(text: str | None) -> float | None:
    """The number in a cell, or None if the cell has none."""
    try:
        return float(text) if text else None
    except ValueError:
        return None


def _files_in(paths: Iterable[str], pattern: str, missing: list[str]) -> Iterator[tuple[Path, Path]]:
    """(root, file) of each file in `paths`, which are files or folders. Missing paths are added to `missing`.

    pattern: of the files that are taken from folders. Hidden files do not count: they are half-written.
    """
    for root in map(Path, paths):
        if not root.exists():
            missing.append(str(root))
        for file in sorted(root.rglob(pattern)) if root.is_dir() else [root]:
            if file.is_file() and not file.name.startswith("."):
                yield root, file


def _read_jobs(
    paths: Iterable[str], missing: list[str], batch_rules: Container[str], batches: Container[str]
) -> dict[str, list[dict[str, float]]]:
    """Rule -> rows of every benchmark in `paths`, whose files are called <rule>.tsv or <rule>/<name>.tsv.

    Of the rules in `batch_rules`, only benchmarks whose name is in `batches` are read.
    """
    jobs: dict[str, list[dict[str, float]]] = defaultdict(list)
    for root, path in _files_in(paths, "*.tsv", missing):
        rule = path.stem if path == root else path.relative_to(root).parts[0].removesuffix(".tsv")
        if rule not in batch_rules or path.stem in batches:
            jobs[rule] += read_benchmark(path)
    return jobs


def _scale_times(rows: list[dict[str, float]], seconds: float) -> None:
    """Make the times of a rule's jobs longer, so that they add up to `seconds`, the time of all its clips.

    The measured time is too short if the jobs found clips that earlier starts of the workflow had made. Times
    are never made shorter.
    """
    measured_seconds = sum(row.get("s", 0.0) for row in rows)
    if seconds > measured_seconds > 0:
        for row in rows:
            row["s"] = row.get("s", 0.0) * seconds / measured_seconds


def _file_sizes(paths: Iterable[str], missing: list[str]) -> list[int]:
    """Bytes of every file in `paths`."""
    return [path.stat().st_size for _, path in _files_in(paths, "*", missing)]


def _training_seconds(paths: Iterable[str]) -> float:
    """Seconds of training over all starts, from history.csv in one of the folders `paths`; 0 without it."""
    for path in (Path(folder) / "history.csv" for folder in paths):
        if path.is_file():
            return max((s for s in read_numbers(path).get("seconds", []) if s is not None), default=0.0)
    return 0.0


def _total_of_jobs(rows: list[dict[str, float]]) -> dict[str, Any]:
    """Totals over jobs. rows: from `read_benchmark`."""
    seconds = [row.get("s", 0.0) for row in rows]
    memory = [row["max_rss"] for row in rows if "max_rss" in row]
    return {
        "jobs": len(rows),
        "seconds": round(sum(seconds), 3),
        "longest": round(max(seconds, default=0.0), 3),
        "cpu_seconds": round(sum(row.get("cpu_time", 0.0) for row in rows), 3),
        "max_rss_mb": round(max(memory), 1) if memory else None,
    }
