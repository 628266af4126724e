"""Build a database in many jobs, with the same bytes as `hobble.database.merge.write_database` in one.

A shard is some of the clips; a part is a consecutive part of the final order of the rows. The job of a shard
reads its clips once, saves their moments and scatters their rows over the parts. The job of a part sorts the
rows that all shards have for it, standardises them and writes chunks. The last job moves the chunks into the
database without reading them.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from hobble.channels.limits import Pace
from hobble.core.files import load_npz, read_json, save_npz, write_error, write_json
from hobble.database.buckets import Buckets
from hobble.database.chunks import Chunk
from hobble.database.manifest import SPLITS, Manifest
from hobble.database.merge import CHUNK_BYTES, all_statistics, publish
from hobble.database.ordered import write_chunks
from hobble.database.pace import gather, paces_of
from hobble.database.plan import Plan, make_plan
from hobble.database.precision import STORED
from hobble.database.scatter import make_buckets, scatter
from hobble.database.statistics import Moments, Statistics, clip_moments
from hobble.rows.compose import fit_columns, x_columns

PLAN, MOMENTS, CHUNKS = "plan.json", "moments.npz", "chunks.json"


def write_shard(
    folder: Path,
    clips: Mapping[str, Path],
    own: Collection[str],
    splits: Mapping[str, str],
    *,
    parts: int,
    channels: Sequence[str],
    sources: Mapping[str, str] | None = None,
    dtype: str = "float32",
    seed: int = 1,
    chunk_bytes: int = CHUNK_BYTES,
) -> None:
    """Scatter the rows of the clips `own` over `parts` parts.

    clips: files of rows of all clips of the database; for clips not in `own` only the outlines are read.
    Other arguments and errors: see `hobble.database.merge.write_database`.
    """
    plan = make_plan(clips, splits, channels, STORED[dtype].itemsize, chunk_bytes)
    paces = paces_of(plan.layout, plan.skeleton)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        buckets = make_buckets(folder, plan, part_rows(plan, parts))
        moments, names = [], []
        for entry, clip in scatter(buckets, {name: clips[name] for name in own}, plan, seed):
            if entry["split"] == "train":
                names.append(entry["clip"])
                moments.append(clip_moments(clip, plan.layout))
                gather(paces, clip, (sources or {}).get(entry["clip"]))
        _save_moments(folder / MOMENTS, names, moments)
        for channel, pace in paces.items():
            cycles = {
                f"{number}.{key}": values
                for number, name in enumerate(names)
                for key, values in pace.to_arrays(name).items()
            }
            save_npz(folder / f"pace-{channel}.npz", clips=np.array(names, str), **cycles)
        plan.save(folder / PLAN)
    except OSError as error:
        raise write_error(error, folder) from error


def part_rows(plan: Plan, parts: int) -> dict[str, int]:
    """Split -> rows of each part, a multiple of a bucket's rows. The last parts may have fewer or none."""
    buckets = {split: -(-plan.rows(split) // plan.bucket_rows) for split in SPLITS}
    return {split: max(1, -(-count // parts)) * plan.bucket_rows for split, count in buckets.items()}


def write_part(
    folder: Path,
    shards: Sequence[Path],
    part: int,
    *,
    parts: int,
    joint_weight: float,
    dtype: str = "float32",
) -> None:
    """Write the chunks of part `part`, from 0, of `parts`, from the rows that all shards have for it."""
    plan = Plan.load(shards[0] / PLAN)
    statistics = merged_statistics(plan, shards, joint_weight)
    rows = part_rows(plan, parts)
    columns, of_fits = x_columns(plan.layout) + plan.layout.y_size, fit_columns(plan.layout)
    written: dict[str, list[Chunk]] = {}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for split in SPLITS:
            start = part * rows[split]
            count = max(0, min(rows[split], plan.rows(split) - start))
            ordered = Buckets(folder / f"buckets-{split}", count, plan.bucket_rows, columns, of_fits)
            for shard in shards if count else ():
                place = (shard / f"buckets-{split}", plan.rows(split), rows[split], columns, of_fits)
                frames, fits, index = Buckets(*place, there=True).read(part)
                index["place"] -= start
                ordered.add(frames, fits, index)
            number = start // plan.chunk_rows
            written[split] = list(write_chunks(folder, split, ordered, plan, statistics, dtype, number))
            (folder / f"buckets-{split}").rmdir()
        write_json(folder / CHUNKS, {split: [asdict(chunk) for chunk in written[split]] for split in SPLITS})
    except OSError as error:
        raise write_error(error, folder) from error


def join_parts(
    path: Path, shards: Sequence[Path], parts: Sequence[Path], *, joint_weight: float, dtype: str = "float32"
) -> Manifest:
    """Build the database folder `path` from its parts, in order, and the moments and speeds of the shards."""
    plan = Plan.load(shards[0] / PLAN)
    statistics = merged_statistics(plan, shards, joint_weight)
    chunks: dict[str, list[Chunk]] = {split: [] for split in SPLITS}
    path.mkdir(parents=True, exist_ok=True)
    work = path / f"part-{os.getpid()}"
    try:
        for part in parts:
            for split, found in read_json(part / CHUNKS).items():
                chunks[split] += [Chunk(**chunk) for chunk in found]
                for chunk in found:
                    _put(part / chunk["file"], work / chunk["file"])
        return publish(path, work, plan, chunks, statistics, _paces(plan, shards), joint_weight, dtype)
    except OSError as error:
        raise write_error(error, path) from error
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _put(source: Path, target: Path) -> None:
    """Link a file to another name, or copy it if the file system has no hard links."""
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


def merged_statistics(plan: Plan, shards: Sequence[Path], joint_weight: float) -> Statistics:
    """The statistics of all training clips, added in the same order as in one job."""
    found: dict[str, tuple[Moments, Moments]] = {}
    for shard in shards:
        data = load_npz(shard / MOMENTS)
        for number, name in enumerate(data["clips"]):
            weight, x, y = data["weight"][number], data["x"][number], data["y"][number]
            found[str(name)] = (Moments(weight[0], *x), Moments(weight[1], *y))
    return all_statistics(plan, [found[e["clip"]] for e in plan.clips if e["clip"] in found], joint_weight)


def _save_moments(path: Path, names: Sequence[str], moments: Sequence[tuple[Moments, Moments]]) -> None:
    """Save weight: (n, 2); x: (n, 2, X), y: (n, 2, Y): mean and squares of each clip."""
    weight = np.array([(x.weight, y.weight) for x, y in moments]).reshape(-1, 2)
    x, y = (np.array([(one[i].mean, one[i].squares) for one in moments]) for i in range(2))
    save_npz(path, clips=np.array(names, str), weight=weight, x=x, y=y)


def _paces(plan: Plan, shards: Sequence[Path]) -> dict[str, Pace]:
    """The collected speeds of all shards, in the same order as in one job."""
    paces = paces_of(plan.layout, plan.skeleton)
    for channel, pace in paces.items():
        found: dict[str, dict[str, np.ndarray]] = {}
        for shard in shards:
            data = load_npz(shard / f"pace-{channel}.npz")
            for number, name in enumerate(data["clips"]):
                start = f"{number}."
                found[str(name)] = {k.removeprefix(start): v for k, v in data.items() if k.startswith(start)}
        for entry in plan.clips:
            if found.get(entry["clip"]):
                pace.add_arrays(entry["clip"], found[entry["clip"]])
    return paces
