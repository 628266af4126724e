"""Time and disk space of each stage, from Snakemake's benchmark files and the sizes of the artefacts."""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Container, Iterable, Mapping
from pathlib import Path

from hobble.core.errors import InputError
from hobble.database.manifest import FILE as MANIFEST
from hobble.database.manifest import Manifest
from hobble.database.sizes import Sizes, sizes
from hobble.evaluation.csv_tables import read_numbers
from hobble.evaluation.pipeline_results import JobTotal, Pipeline, StageTotal
from hobble.report.provenance import machine, versions
from hobble.workflow.kept_files import recorded_seconds


def summarise(configuration: str, stages: Mapping[str, Mapping[str, Iterable[str]]]) -> Pipeline:
    """The content of `pipeline.json`.

    stages: in the order of the pipeline, stage -> {"benchmarks": tsv files or folders of them, "files":
    artefacts or folders of them}. Stages of a data set make their clips in batches. They also have "made":
    folders with records of finished clips, each folder named after the rule that made the clips; and
    "batches": the names of the benchmarks of all present batches. For a rule in "made", other benchmarks do
    not count: they are left from batches that have changed since, for example because a clip was added.

    A missing file is listed under `missing` and is no error: a stage may have been copied from another
    machine without its benchmarks. If a job was stopped and called again, its Snakemake benchmark has only
    the last call. So the time of training is taken from the history, and the time of a rule in "made" from
    the records, if it is longer there.

    The result has `stages` (for each stage: jobs, seconds, `longest` job in seconds, max_rss_mb, cpu_seconds,
    files, bytes; and `rules`, the same without files and bytes for each rule), `total_seconds`,
    `total_bytes`, `database` (see `hobble.database.sizes`; None without a database), `missing`, `machine`,
    `versions`. Raises InputError for a malformed benchmark or history.
    """
    missing: list[str] = []
    entries: list[StageTotal] = []
    for stage, paths in stages.items():
        made = {Path(folder).name: recorded_seconds(Path(folder)) for folder in paths.get("made", ())}
        jobs = _jobs(paths.get("benchmarks", ()), missing, made, set(paths.get("batches", ())))
        trained = _trained(paths.get("files", ()))
        of_files = _sizes(paths.get("files", ()), missing)
        by_rule: dict[str, list[dict[str, float]]] = defaultdict(list)
        for rule, row in jobs:
            if rule == "training":
                row["s"] = max(row.get("s", 0.0), trained)
            by_rule[rule].append(row)
        for rule, seconds in made.items():
            _add_earlier_calls(by_rule[rule], seconds)
        entries.append(
            {
                "stage": stage,
                **_total([row for _, row in jobs]),
                "files": len(of_files),
                "bytes": sum(of_files),
                "rules": [{"rule": rule, **_total(rows)} for rule, rows in sorted(by_rule.items()) if rows],
            }
        )
    return {
        "configuration": configuration,
        "stages": entries,
        "total_seconds": round(sum(entry["seconds"] for entry in entries), 3),
        "total_bytes": sum(entry["bytes"] for entry in entries),
        "database": _database(stages.get("database", {}).get("files", ())),
        "missing": sorted(missing),
        "machine": machine(),
        "versions": versions(),
    }


def read_benchmark(path: str | Path) -> list[dict[str, float]]:
    """The rows of a Snakemake benchmark file. Values that were not measured ("-", "NA") are left out.

    Raises InputError if the file is not a benchmark.
    """
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file, delimiter="\t"))
    if rows and "s" not in rows[0]:
        raise InputError(path, "not a Snakemake benchmark: it has no column `s`", fix="Delete it.")
    return [
        {key: number for key, text in row.items() if (number := _number(text)) is not None} for row in rows
    ]


def _number(text: str | None) -> float | None:
    try:
        return float(text) if text else None
    except ValueError:
        return None


def _jobs(
    paths: Iterable[str], missing: list[str], made: Container[str], batches: Container[str]
) -> list[tuple[str, dict[str, float]]]:
    """(rule, row) of every benchmark in `paths`: <rule>.tsv or <rule>/<name>.tsv.

    For rules in `made`, only benchmarks whose name is in `batches` are read. Missing paths are added to
    `missing`.
    """
    found = []
    for root in map(Path, paths):
        if root.is_dir():
            files = [
                (p.relative_to(root).parts[0].removesuffix(".tsv"), p) for p in sorted(root.rglob("*.tsv"))
            ]
        elif root.is_file():
            files = [(root.stem, root)]
        else:
            missing.append(str(root))
            continue
        files = [(rule, path) for rule, path in files if rule not in made or path.stem in batches]
        found += [(rule, row) for rule, path in files for row in read_benchmark(path)]
    return found


def _add_earlier_calls(rows: list[dict[str, float]], seconds: float) -> None:
    """Scale the times of a rule's jobs so that they add up to `seconds`, the time that all its clips took.

    The measured time of the jobs is shorter if earlier calls had already made some of the clips.
    """
    measured = sum(row.get("s", 0.0) for row in rows)
    if seconds > measured > 0:
        for row in rows:
            row["s"] = row.get("s", 0.0) * seconds / measured


def _sizes(paths: Iterable[str], missing: list[str]) -> list[int]:
    """Bytes of every file in `paths`. Hidden files do not count, because they are half-written."""
    sizes = []
    for root in map(Path, paths):
        if root.is_dir():
            files = [p for p in root.rglob("*") if p.is_file() and not p.name.startswith(".")]
            sizes += [p.stat().st_size for p in files]
        elif root.is_file():
            sizes.append(root.stat().st_size)
        else:
            missing.append(str(root))
    return sizes


def _trained(paths: Iterable[str]) -> float:
    """Seconds of training over all calls, from the history among the artefacts."""
    for path in map(Path, paths):
        if (path / "history.csv").is_file():
            seconds = read_numbers(path / "history.csv").get("seconds", [])
            return max((s for s in seconds if s is not None), default=0.0)
    return 0.0


def _database(paths: Iterable[str]) -> Sizes | None:
    """The sizes of the database, if it is among the artefacts in `paths`."""
    for path in map(Path, paths):
        if (path / MANIFEST).is_file():
            return sizes(Manifest.load(path))
    return None


def _total(rows: list[dict[str, float]]) -> JobTotal:
    seconds = [row.get("s", 0.0) for row in rows]
    memory = [row["max_rss"] for row in rows if "max_rss" in row]
    return {
        "jobs": len(rows),
        "seconds": round(sum(seconds), 3),
        "longest": round(max(seconds, default=0.0), 3),
        "cpu_seconds": round(sum(row.get("cpu_time", 0.0) for row in rows), 3),
        "max_rss_mb": round(max(memory), 1) if memory else None,
    }
