"""How a result was made: versions, commit and machine, and the time, memory and disk space of each stage.

Time and memory are from Snakemake's benchmark files, disk space from the sizes of the artefacts.
"""

import json
import os
import platform
import subprocess
from collections.abc import Iterable, Iterator, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import pandas
import psutil

from hobble.core.errors import InputError
from hobble.core.files import read_json, read_numbers
from hobble.core.processors import processor_name
from hobble.database.chunks import FILE as MANIFEST
from hobble.database.chunks import Manifest, database_sizes

WEB = Path(__file__).parent / "web"  # the page's scripts
MEASURED = ("s", "max_rss", "cpu_time")  # columns of a benchmark that are read
# The Python packages whose versions are reported.
PACKAGES = ("hobble", "torch", "numpy", "scipy", "numba", "snakemake", "pydantic", "jinja2")


def versions() -> dict[str, str]:
    """Name -> version, for Python, the main Python packages and the page's npm packages."""
    npm = json.loads((WEB / "package.json").read_text(encoding="utf-8"))["dependencies"]
    return {"python": platform.python_version()} | {name: metadata.version(name) for name in PACKAGES} | npm


def machine() -> dict[str, Any]:
    """System, processor, cores and memory of this machine, but not the name of the host or the user."""
    return {
        "system": f"{platform.system()} {platform.machine()}",
        "processor": processor_name(),
        "cores": os.cpu_count(),
        "memory_gb": round(psutil.virtual_memory().total / 1e9, 1),
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
    configuration: str, stages: Mapping[str, Mapping[str, Iterable[str]]]
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
        jobs = read_jobs(paths, missing)
        files = [path.stat().st_size for _, path in _files_in(paths.get("files", ()), "*", missing)]
        rules = [{"rule": rule, **totals_of_jobs(of_rule)} for rule, of_rule in jobs.groupby("rule")]
        sizes = {"files": len(files), "bytes": sum(files)}
        entries.append({"stage": stage, **totals_of_jobs(jobs), **sizes, "rules": rules})
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


def read_jobs(paths: Mapping[str, Iterable[str]], missing: list[str]) -> pandas.DataFrame:
    """A row for each job of a stage, with its `rule` and the columns of its benchmark, such as `s`.

    paths: a value of `summarise_pipeline`'s `stages`. Benchmarks are called <rule>.tsv or <rule>/<name>.tsv.
    """
    # Rule -> seconds that it took to make the clips of the rule, from the records in its folder.
    made = {
        Path(folder).name: sum(float(read_json(path)["seconds"]) for path in Path(folder).rglob("*.json"))
        for folder in paths.get("made", ())
    }
    batches = set(paths.get("batches", ()))
    benchmarks = [pandas.DataFrame(columns=["rule", *MEASURED])]
    for root, path in _files_in(paths.get("benchmarks", ()), "*.tsv", missing):
        rule = path.stem if path == root else path.relative_to(root).parts[0].removesuffix(".tsv")
        if rule not in made or path.stem in batches:
            benchmarks.append(read_benchmark(path).assign(rule=rule))
    jobs = pandas.concat(benchmarks).astype(dict.fromkeys(MEASURED, float)).reset_index(drop=True)
    training = jobs["rule"] == "training"
    jobs.loc[training, "s"] = jobs["s"][training].clip(lower=_training_seconds(paths.get("files", ())))
    for rule, seconds in made.items():
        of_rule = jobs["rule"] == rule
        measured = jobs["s"][of_rule].sum()
        if measured > 0:  # too short if the jobs found clips that earlier starts of the workflow had made
            jobs.loc[of_rule, "s"] *= max(1.0, seconds / measured)
    return jobs


def read_benchmark(path: str | Path) -> pandas.DataFrame:
    """A Snakemake benchmark file, with a row for each run of the job. Raises InputError if it is not one."""
    try:
        rows = pandas.read_csv(path, sep="\t", na_values="-")
    except (pandas.errors.ParserError, pandas.errors.EmptyDataError):
        rows = pandas.DataFrame()
    if "s" not in rows:
        raise InputError(path, "not a Snakemake benchmark: it has no column `s`", fix="Delete it.")
    return rows.reindex(columns=list(MEASURED))


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


def _training_seconds(paths: Iterable[str]) -> float:
    """Seconds of training over all starts, from history.csv in one of the folders `paths`; 0 without it."""
    for path in (Path(folder) / "history.csv" for folder in paths):
        if path.is_file():
            return max((s for s in read_numbers(path).get("seconds", []) if s is not None), default=0.0)
    return 0.0


def totals_of_jobs(jobs: pandas.DataFrame) -> dict[str, Any]:
    """Totals over some rows of `read_jobs`."""
    memory = jobs["max_rss"].max()
    return {
        "jobs": len(jobs),
        "seconds": round(float(jobs["s"].sum()), 3),
        "longest": round(float(jobs["s"].max()), 3) if len(jobs) else 0.0,
        "cpu_seconds": round(float(jobs["cpu_time"].sum()), 3),
        "max_rss_mb": None if pandas.isna(memory) else round(float(memory), 1),
    }
