"""With `database.parts` several jobs merge the database. The result is the same database and nothing else."""

from __future__ import annotations

import shutil
from pathlib import Path


def contents(path: Path) -> dict[str, bytes]:
    files = (f for f in sorted(path.rglob("*")) if f.is_file() and not f.name.startswith("."))
    return {str(f.relative_to(path)): f.read_bytes() for f in files}


def test_three_jobs_merge_what_one_did(copied) -> None:
    database = copied.folder / "results/datasets/tiny/database/injury"
    before = contents(database)
    assert before
    shutil.rmtree(database)
    copied.edit("config/datasets/tiny.yaml", "clips:\n", "database: {parts: 3}\nclips:\n")
    target = "results/datasets/tiny/database/injury"
    planned = copied.planned(target)
    merging = {"database_shard": 3, "database_part": 3, "database_merge": 1}
    assert {rule: n for rule, n in planned.items() if rule in merging} == merging
    copied.run("-c2", target)
    assert contents(database) == before
    assert not (database.parent / "parts").exists() or not any((database.parent / "parts").rglob("shard-*"))
    assert "database_merge" not in copied.planned(target)
