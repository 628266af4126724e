"""Merge shards into a database, without reading their rows.

The chunks of the shards get a second name (a hard link) in the database's folder. The statistics of all
training rows are computed from the moments (weights, means, squared differences from the mean) that each
shard stores. The manifest is written last and atomically. So a killed merge leaves the previous database, or
none.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from pathlib import Path

import numpy as np

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import save_npz, sync_folder, write_error
from hobble.database.chunks import Chunk
from hobble.database.learn_limits import limit_learners
from hobble.database.manifest import FILE, SCALES, SPLITS, STATISTICS, Manifest, ShardCounts
from hobble.database.plan import RowSource, fit_together
from hobble.database.shard import CHUNK_BYTES, Shard, add_moments, row_statistics, write_shard


def write_database(
    path: str | Path,
    clips: Mapping[str, RowSource],
    splits: Mapping[str, str],
    *,
    channels: Sequence[str],
    sources: Mapping[str, str] | None = None,
    every: int = 1,
    joint_weight: float,
    dtype: str = "float32",
    seed: int = 1,
    chunk_bytes: int = CHUNK_BYTES,
) -> Manifest:
    """Build a database with one shard in folder `path` from the rows of clips, or from files of rows.

    clips: clip name -> rows or file. splits: clip name -> "train" or "held_out". channels: the network's
    input channels, in the order of their columns. sources: name of a hurt version -> name of the healthy clip
    it was made from. every: of the training rows of a hurt version, only each `every`-th is used.
    joint_weight: weight of the joints in the network's input. dtype: type of the numbers on disk. seed: of
    the order of the rows. chunk_bytes: about the size of a chunk. The statistics are those of the training
    clips. The same rows and options give the same bytes. Raises HobbleError if no training clip has rows,
    InputError if the rows of the clips differ in columns or joints.
    """
    with _work(Path(path)) as work:
        shard = work / "0"
        write_shard(
            shard,
            clips,
            splits,
            channels=channels,
            sources=sources,
            every=every,
            joint_weight=joint_weight,
            dtype=dtype,
            seed=seed,
            chunk_bytes=chunk_bytes,
        )
        return _merged(Path(path), work, [shard], joint_weight, dtype)


def merge_shards(
    path: str | Path, shards: Sequence[Path], *, joint_weight: float, dtype: str = "float32"
) -> Manifest:
    """Build the database folder `path` from the folders of its shards, in order.

    Raises HobbleError if no training clip has rows, InputError if the rows of the shards differ in columns or
    joints.
    """
    with _work(Path(path)) as work:
        return _merged(Path(path), work, shards, joint_weight, dtype)


@contextlib.contextmanager
def _work(path: Path) -> Iterator[Path]:
    """Make a folder for unfinished files in the database's folder `path`, and remove it at the end.

    Folders left by killed builds are removed first. Raises HobbleError for a file that cannot be written.
    """
    path.mkdir(parents=True, exist_ok=True)
    _remove_others(path, keep=None)
    work = path / f"part-{os.getpid()}"
    work.mkdir()
    try:
        yield work
    except OSError as error:
        raise write_error(error, path) from error
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _merged(path: Path, work: Path, folders: Sequence[Path], joint_weight: float, dtype: str) -> Manifest:
    """Merge shards in the folder `work`, then move the result to the folder `path`."""
    shards = [shard for folder in folders if (shard := Shard.load(folder)) is not None]
    _check(shards)
    plan, clips = shards[0].plan, [entry for shard in shards for entry in shard.plan.clips]
    statistics = row_statistics(
        plan, reduce(add_moments, (shard.moments() for shard in shards)), joint_weight
    )
    rows = work / "rows"
    chunks = _linked(shards, rows)
    save_npz(rows / STATISTICS, **vars(statistics))
    scales = [shard.statistics() for shard in shards]
    save_npz(
        rows / SCALES,
        **{name: np.stack([vars(scale)[name] for scale in scales]) for name in vars(statistics)},
    )
    learners = limit_learners(plan.layout, plan.skeleton)
    for shard in shards:
        shard.add_speeds(learners)
    visits = max(shard.plan.visits for shard in shards)
    numbers = plan.layout.x_size + plan.layout.y_size + 1  # of a row: X, Y and the phase
    manifest = Manifest(
        folder=_folder_name(rows, chunks),
        layout=plan.layout,
        skeleton=plan.skeleton,
        visits=visits,
        dtype=dtype,
        joint_weight=joint_weight,
        clips=clips,
        shards=[ShardCounts(len(s.plan.clips), *(len(s.chunks[split]) for split in SPLITS)) for s in shards],
        chunks=chunks,
        original_bytes=4 * numbers * visits * sum(entry["rows"] for entry in clips),
        bytes=sum(chunk.bytes for split in SPLITS for chunk in chunks[split]),
        limits={name: learnt.to_dict() for name, learner in learners.items() if (learnt := learner.learn())},
    )
    _put_in_place(path, rows, manifest)
    return manifest


def _check(shards: Sequence[Shard]) -> None:
    """Check that there is something to train on, and that all shards have the same columns and joints."""
    trained = (entry["rows"] for s in shards for entry in s.plan.clips if entry["split"] == "train")
    if not any(trained):
        raise HobbleError(
            "There is nothing to train on: no clip of the training part has a whole locomotion "
            "cycle. Add clips, or hold fewer out."
        )
    first = shards[0].plan
    for shard in shards:
        if not fit_together(shard.plan, first):
            clip, other = shard.plan.clips[0]["clip"], first.clips[0]["clip"]
            raise InputError(clip, f"the layout of its rows differs from that of {other}")


def _linked(shards: Sequence[Shard], rows: Path) -> dict[str, list[Chunk]]:
    """Give the chunks of all shards a second name in the folder `rows`, or copy them if hard links fail."""
    linked: dict[str, list[Chunk]] = {split: [] for split in SPLITS}
    for shard in shards:
        for split, chunks in shard.chunks.items():
            for chunk in chunks:
                named = replace(chunk, file=f"{shard.folder.name}/{chunk.file}")
                target = rows / named.file
                target.parent.mkdir(parents=True, exist_ok=True)
                try:
                    os.link(shard.folder / chunk.file, target)
                except FileNotFoundError:
                    raise
                except OSError:
                    shutil.copyfile(shard.folder / chunk.file, target)
                linked[split].append(named)
    return linked


def _remove_others(path: Path, keep: str | None) -> None:
    """Remove what killed builds left. If `keep` names the folder of a build, also remove all other builds."""
    for entry in path.iterdir():
        if entry.is_dir() and (entry.name.startswith("part-") or (keep is not None and entry.name != keep)):
            shutil.rmtree(entry, ignore_errors=True)
    for entry in path.glob(f".{FILE}.*.part"):
        entry.unlink()


def _folder_name(rows: Path, chunks: Mapping[str, list[Chunk]]) -> str:
    """The name of a build's folder, from a hash of its content."""
    digest = hashlib.sha256((rows / STATISTICS).read_bytes() + (rows / SCALES).read_bytes())
    digest.update(repr(chunks).encode())
    return f"rows-{digest.hexdigest()[:12]}"


def _put_in_place(path: Path, rows: Path, manifest: Manifest) -> None:
    """Rename the finished build, write the manifest, then remove the previous build."""
    final = path / manifest.folder
    if final.exists():  # the same rows were built before: replace every file, since some may be damaged
        for file in sorted(p for p in rows.rglob("*") if p.is_file()):
            place = final / file.relative_to(rows)
            # The subfolder is gone if an earlier process was killed while it removed this build.
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(file, place)
        sync_folder(final)
    else:
        os.rename(rows, final)
    manifest.save(path)
    _remove_others(path, keep=manifest.folder)
