"""Merges shards into a database, without reading their rows.

A shard has the rows of some clips, in files called chunks. The chunks of all shards get a second name (a hard
link) in the database's folder. The statistics of all training rows are computed from the moments (weights,
means, squared differences from the mean) that each shard stores. The manifest is written last, completely or
not at all. So a merge that is killed leaves the previous database, or none.
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
from hobble.core.files import failed_write_error, save_npz, sync_folder
from hobble.database.chunks import Chunk
from hobble.database.learn_limits import make_limit_learners
from hobble.database.manifest import FILE, SCALES, SPLITS, STATISTICS, Manifest, ShardCounts
from hobble.database.plan import RowSource, have_same_columns
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
    """Build a database with one shard in the folder `path`. Returns its manifest.

    clips: clip name -> its rows, or the file with them. splits: clip name -> "train" or "held_out". channels:
    the network's input channels, in the order of their columns. sources: name of a hurt version -> name of
    the healthy clip from which it was computed. every: a hurt version in training uses only each `every`-th
    of its rows. joint_weight: factor by which the standardised joints in the network's input are multiplied.
    dtype: type of the numbers on disk. seed: seed of the order of the rows. chunk_bytes: rough size of a
    chunk. The statistics are those of the training clips. The same rows and options give the same bytes.
    Raises HobbleError if no training clip has rows, InputError if the rows of the clips differ in columns or
    joints.
    """
    with _work_folder(Path(path)) as work:
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
        return _merge(Path(path), work, [shard], joint_weight, dtype)


def merge_shards(
    path: str | Path, shards: Sequence[Path], *, joint_weight: float, dtype: str = "float32"
) -> Manifest:
    """Build the database folder `path` from the folders `shards`, in their order. Returns its manifest.

    joint_weight, dtype: as in `write_database`. Raises HobbleError if no training clip has rows,
    InputError if the rows of the shards differ in columns or joints.
    """
    with _work_folder(Path(path)) as work:
        return _merge(Path(path), work, shards, joint_weight, dtype)


@contextlib.contextmanager
def _work_folder(path: Path) -> Iterator[Path]:
    """Make a folder for unfinished files in the database's folder `path`, and remove it at the end.

    Folders left by killed builds are removed first. Raises HobbleError for a file that cannot be written.
    """
    path.mkdir(parents=True, exist_ok=True)
    _remove_unused(path, keep=None)
    work = path / f"part-{os.getpid()}"
    work.mkdir()
    try:
        yield work
    except OSError as error:
        raise failed_write_error(error, path) from error
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _merge(path: Path, work: Path, folders: Sequence[Path], joint_weight: float, dtype: str) -> Manifest:
    """Merge the shards in `folders` inside the folder `work`, then move the result to the folder `path`."""
    shards = [shard for folder in folders if (shard := Shard.load(folder)) is not None]
    _check_shards(shards)
    plan, clips = shards[0].plan, [entry for shard in shards for entry in shard.plan.clips]
    statistics = row_statistics(
        plan, reduce(add_moments, (shard.moments() for shard in shards)), joint_weight
    )
    build = work / "rows"
    chunks = _link_chunks(shards, build)
    save_npz(build / STATISTICS, **vars(statistics))
    scales = [shard.statistics() for shard in shards]
    save_npz(
        build / SCALES,
        **{name: np.stack([vars(scale)[name] for scale in scales]) for name in vars(statistics)},
    )
    learners = make_limit_learners(plan.layout, plan.skeleton)
    for shard in shards:
        shard.add_speeds(learners)
    visits = max(shard.plan.visits for shard in shards)
    row_numbers = plan.layout.x_size + plan.layout.y_size + 1  # numbers in a row: X, Y and the phase
    manifest = Manifest(
        folder=_folder_name(build, chunks),
        layout=plan.layout,
        skeleton=plan.skeleton,
        visits=visits,
        dtype=dtype,
        joint_weight=joint_weight,
        clips=clips,
        shards=[ShardCounts(len(s.plan.clips), *(len(s.chunks[split]) for split in SPLITS)) for s in shards],
        chunks=chunks,
        original_bytes=4 * row_numbers * visits * sum(entry["rows"] for entry in clips),
        bytes=sum(chunk.bytes for split in SPLITS for chunk in chunks[split]),
        limits={name: learnt.to_dict() for name, learner in learners.items() if (learnt := learner.learn())},
    )
    _put_in_place(path, build, manifest)
    return manifest


def _check_shards(shards: Sequence[Shard]) -> None:
    """Check that there are training rows, and that the rows of all shards have the same columns and joints.

    Raises HobbleError or InputError.
    """
    trained = (entry["rows"] for s in shards for entry in s.plan.clips if entry["split"] == "train")
    if not any(trained):
        raise HobbleError(
            "There is nothing to train on: no training clip has a whole locomotion cycle. Add clips, or list "
            "fewer under held_out."
        )
    first = shards[0].plan
    for shard in shards:
        if not have_same_columns(shard.plan, first):
            clip, other = shard.plan.clips[0]["clip"], first.clips[0]["clip"]
            raise InputError(clip, f"the layout of its rows differs from that of {other}")


def _link_chunks(shards: Sequence[Shard], build: Path) -> dict[str, list[Chunk]]:
    """Give the chunks of all shards a second name in the folder `build`, or copy them if hard links fail.

    Returns split -> chunks with their paths in `build`.
    """
    linked: dict[str, list[Chunk]] = {split: [] for split in SPLITS}
    for shard in shards:
        for split, chunks in shard.chunks.items():
            for chunk in chunks:
                named = replace(chunk, file=f"{shard.folder.name}/{chunk.file}")
                target = build / named.file
                target.parent.mkdir(parents=True, exist_ok=True)
                try:
                    os.link(shard.folder / chunk.file, target)
                except FileNotFoundError:
                    raise
                except OSError:
                    shutil.copyfile(shard.folder / chunk.file, target)
                linked[split].append(named)
    return linked


def _remove_unused(path: Path, keep: str | None) -> None:
    """Remove the files that killed builds left in the database folder `path`.

    keep: name of the folder of a finished build, to remove the folders of all others; None to keep all.
    """
    for entry in path.iterdir():
        if entry.is_dir() and (entry.name.startswith("part-") or (keep is not None and entry.name != keep)):
            shutil.rmtree(entry, ignore_errors=True)
    for entry in path.glob(f".{FILE}.*.part"):
        entry.unlink()


def _folder_name(build: Path, chunks: Mapping[str, list[Chunk]]) -> str:
    """The final name of the folder `build`, from a hash of its content."""
    digest = hashlib.sha256((build / STATISTICS).read_bytes() + (build / SCALES).read_bytes())
    digest.update(repr(chunks).encode())
    return f"rows-{digest.hexdigest()[:12]}"


def _put_in_place(path: Path, build: Path, manifest: Manifest) -> None:
    """Move the folder `build` to its final name, write the manifest, then remove the previous build."""
    final = path / manifest.folder
    if final.exists():  # the same rows were built before: replace every file, since some may be damaged
        for file in sorted(p for p in build.rglob("*") if p.is_file()):
            target = final / file.relative_to(build)
            # A subfolder is missing if a process was killed while it removed this build.
            target.parent.mkdir(parents=True, exist_ok=True)
            os.replace(file, target)
        sync_folder(final)
    else:
        os.rename(build, final)
    manifest.save(path)
    _remove_unused(path, keep=manifest.folder)
