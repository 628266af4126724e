"""Shuffle the rows of all clips and write them in chunks: a two-pass external shuffle in bounded memory.

Pass 1 reads each clip once, adds it to the statistics and scatters its rows over buckets. A bucket holds a
consecutive part of one permutation of all rows. Pass 2 sorts each bucket into the permutation's order,
standardises it and writes its chunks. The manifest is written last and atomically. So a killed build leaves
the previous database, or none.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path

from hobble.channels.limits import Pace
from hobble.core.files import save_npz, sync_folder, write_error
from hobble.database.chunks import Chunk
from hobble.database.manifest import FILE, SPLITS, STATISTICS, Manifest
from hobble.database.ordered import write_chunks
from hobble.database.pace import gather, paces_of
from hobble.database.plan import Plan, Source, make_plan
from hobble.database.precision import STORED
from hobble.database.scatter import make_buckets, scatter
from hobble.database.statistics import Moments, Statistics, clip_moments, finish, unseen_joints

CHUNK_BYTES = 4 << 20  # read at a time: large enough to be fast on any disk, small enough for any memory


def write_database(
    path: str | Path,
    clips: Mapping[str, Source],
    splits: Mapping[str, str],
    *,
    channels: Sequence[str],
    sources: Mapping[str, str] | None = None,
    joint_weight: float,
    dtype: str = "float32",
    seed: int = 1,
    chunk_bytes: int = CHUNK_BYTES,
) -> Manifest:
    """Build the database folder `path` from the rows of clips, or from files of rows.

    clips: clip name -> rows or file. splits: clip name -> "train" or "held_out". channels: the network's
    input channels, in the order of their columns. sources: hurt version -> its healthy clip. dtype: float32,
    float16 or bfloat16. The statistics are those of the training clips. The same rows and options give the
    same bytes. Raises HobbleError if no training clip has rows, InputError if a clip does not fit the others.
    """
    path = Path(path)
    path.mkdir(parents=True, exist_ok=True)
    _remove_others(path, keep=None)
    work = path / f"part-{os.getpid()}"
    try:
        work.mkdir()
        plan = make_plan(clips, splits, channels, STORED[dtype].itemsize, chunk_bytes)
        paces = paces_of(plan.layout, plan.skeleton)
        buckets = make_buckets(work, plan, dict.fromkeys(SPLITS, plan.bucket_rows))
        moments = []
        for entry, clip in scatter(buckets, clips, plan, seed):
            if entry["split"] == "train":
                moments.append(clip_moments(clip, plan.layout))
                gather(paces, clip, (sources or {}).get(entry["clip"]))
        statistics = all_statistics(plan, moments, joint_weight)
        chunks = {
            split: list(write_chunks(work, split, buckets[split], plan, statistics, dtype))
            for split in SPLITS
        }
        for folder in work.glob("buckets-*"):
            folder.rmdir()
        return publish(path, work, plan, chunks, statistics, paces, joint_weight, dtype)
    except OSError as error:
        raise write_error(error, path) from error
    finally:
        shutil.rmtree(work, ignore_errors=True)


def all_statistics(plan: Plan, moments: Sequence[tuple[Moments, Moments]], joint_weight: float) -> Statistics:
    """The statistics of a database, from the moments of X and Y of each training clip, in order."""
    x, y = moments[0]
    for of_x, of_y in moments[1:]:
        x, y = x + of_x, y + of_y
    return finish(plan.layout, x, y, joint_weight, unseen_joints(plan.skeleton))


def publish(
    path: Path,
    work: Path,
    plan: Plan,
    chunks: Mapping[str, list[Chunk]],
    statistics: Statistics,
    paces: Mapping[str, Pace],
    joint_weight: float,
    dtype: str,
) -> Manifest:
    """Turn the folder `work`, which holds all chunks, into the database in the folder `path`."""
    save_npz(work / STATISTICS, **{f.name: getattr(statistics, f.name) for f in fields(statistics)})
    manifest = Manifest(
        folder=_folder_name(work, chunks),
        layout=plan.layout,
        skeleton=plan.skeleton,
        visits=plan.visits,
        dtype=dtype,
        joint_weight=joint_weight,
        clips=plan.clips,
        chunks=chunks,
        original_bytes=plan.original_bytes,
        bytes=sum(chunk.bytes for split in SPLITS for chunk in chunks[split]),
        limits={name: found.to_dict() for name, pace in paces.items() if (found := pace.learn())},
    )
    _put_in_place(path, work, manifest)
    return manifest


def _remove_others(path: Path, keep: str | None) -> None:
    """Remove leftovers of killed builds and, with `keep`, all builds but that one."""
    for entry in path.iterdir():
        if entry.is_dir() and (entry.name.startswith("part-") or (keep is not None and entry.name != keep)):
            shutil.rmtree(entry, ignore_errors=True)
    for entry in path.glob(f".{FILE}.*.part"):
        entry.unlink()


def _folder_name(work: Path, chunks: Mapping[str, list[Chunk]]) -> str:
    """A name for the build from a hash of its content."""
    digest = hashlib.sha256((work / STATISTICS).read_bytes())
    digest.update(repr(chunks).encode())
    return f"rows-{digest.hexdigest()[:12]}"


def _put_in_place(path: Path, work: Path, manifest: Manifest) -> None:
    """Rename the finished build, write the manifest, then remove the previous build."""
    final = path / manifest.folder
    if final.exists():  # the same rows were built before: replace every file, since some may be damaged
        for file in sorted(p for p in work.rglob("*") if p.is_file()):
            place = final / file.relative_to(work)
            place.parent.mkdir(parents=True, exist_ok=True)  # a killed removal may have left a part
            os.replace(file, place)
        sync_folder(final)
    else:
        os.rename(work, final)
    manifest.save(path)
    _remove_others(path, keep=manifest.folder)
