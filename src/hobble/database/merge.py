"""The rows of all clips, shuffled once and written in chunks: a two-pass external shuffle in bounded memory.

Pass 1 reads each clip once, adds it to the statistics and scatters its rows over buckets, each of which
holds a stretch of one permutation of all rows. Pass 2 puts each bucket into the permutation's order,
standardises it and writes its chunks. The manifest, written last and by renaming, is what makes the folder
a database: a build that is killed leaves the database that was there before, or none.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels.limits import Pace
from hobble.core.errors import HobbleError, InputError
from hobble.core.files import save_npz, sync_folder, write_error
from hobble.core.quat import Array
from hobble.database.buckets import INDEX, Buckets
from hobble.database.chunks import Chunk, write_chunk
from hobble.database.manifest import FILE, SPLITS, STATISTICS, Manifest
from hobble.database.pace import gather, paces_of
from hobble.database.precision import STORED, narrow
from hobble.database.split import split_rows
from hobble.database.statistics import Moments, Statistics, clip_moments, finish, unseen_joints
from hobble.rows.clip_rows import ClipRows, Outline, load_clip_rows, outline
from hobble.rows.compose import fit_columns, frame_inputs, x_columns
from hobble.rows.layout import RowLayout

CHUNK_BYTES = 4 << 20  # what a reader takes in one go: long enough for any disk, short enough for any memory
PART_ROWS = 8192  # of a clip that are scattered at a time
BUCKET_BYTES = 64 << 20  # the memory of pass 2, a few times over

Source = ClipRows | str | Path


@dataclass(frozen=True)
class Plan:
    """What is known before a row is written: the layout of the rows, their clips and how they are cut up."""

    layout: RowLayout
    skeleton: Mapping[str, Any]
    visits: int
    clips: list[dict[str, Any]]
    chunk_rows: int
    bucket_rows: int

    def rows(self, split: str) -> int:
        """Rows of a split."""
        return sum(clip["rows"] for clip in self.clips if clip["split"] == split)


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
    """Build the database folder `path` from rows by clip name, or from the files that hold them.

    splits: clip name -> "train" or "held_out". channels: those that the network is told, in the order of
    their columns. sources: hurt version -> the healthy clip that it was made from.
    dtype: float32, float16 or bfloat16. The statistics are those of the clips in training. The
    same rows and options give the same bytes. Raises HobbleError where no clip has rows to train on,
    InputError where a clip does not fit the others.
    """
    path = Path(path)
    path.mkdir(parents=True, exist_ok=True)
    _sweep(path, keep=None)
    work = path / f"part-{os.getpid()}"
    try:
        work.mkdir()
        plan = _plan(clips, splits, channels, STORED[dtype].itemsize, chunk_bytes)
        paces = paces_of(plan.layout, plan.skeleton)
        buckets, moments = _scatter(work, clips, plan, seed, paces, sources or {})
        unseen = unseen_joints(plan.skeleton)
        statistics = finish(plan.layout, *moments, joint_weight, unseen)
        chunks = {
            split: list(_chunks(work, split, buckets[split], plan, statistics, dtype)) for split in SPLITS
        }
        save_npz(work / STATISTICS, **{f.name: getattr(statistics, f.name) for f in fields(statistics)})
        manifest = Manifest(
            folder=_name(work, chunks),
            layout=plan.layout,
            skeleton=plan.skeleton,
            visits=plan.visits,
            dtype=dtype,
            joint_weight=joint_weight,
            clips=plan.clips,
            chunks=chunks,
            original_bytes=_original_bytes(plan),
            bytes=sum(chunk.bytes for split in SPLITS for chunk in chunks[split]),
            limits={name: found.to_dict() for name, pace in paces.items() if (found := pace.learn())},
        )
        _publish(path, work, manifest)
        return manifest
    except OSError as error:
        raise write_error(error, path) from error
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _sweep(path: Path, keep: str | None) -> None:
    """Remove what a killed build left and, with `keep`, every build but that one."""
    for entry in path.iterdir():
        if entry.is_dir() and (entry.name.startswith("part-") or (keep is not None and entry.name != keep)):
            shutil.rmtree(entry, ignore_errors=True)
    for entry in path.glob(f".{FILE}.*.part"):
        entry.unlink()


def _plan(
    clips: Mapping[str, Source],
    splits: Mapping[str, str],
    channels: Sequence[str],
    item: int,
    chunk_bytes: int,
) -> Plan:
    entries: list[dict[str, Any]] = []
    first: Outline | None = None
    visits, pairs, rows = 1, 0, 0
    for name in sorted(clips):
        one = outline(clips[name])
        first = first or one
        if one.layout != first.layout or list(one.skeleton["joints"]) != list(first.skeleton["joints"]):
            source = clips[name]
            where = name if isinstance(source, ClipRows) else source
            raise InputError(where, f"its rows are not laid out as those of {min(clips)}")
        fits = int(one.fits.sum())
        entries.append({"clip": name, "split": splits[name], "rows": len(one.fits), "pairs": fits})
        visits = max(visits, one.visits, int(one.fits.max(initial=1)))
        rows, pairs = rows + len(one.fits), pairs + fits
    if first is None or not any(e["rows"] for e in entries if e["split"] == "train"):
        raise HobbleError(
            "There is nothing to train on: no clip of the training part has a whole locomotion "
            "cycle. Add clips, or hold fewer out."
        )
    layout = first.layout.with_channels(channels)
    values = x_columns(layout) + layout.y_size + fit_columns(layout) * pairs / rows
    chunk_rows = max(1, int(chunk_bytes / (item * values + 16)))
    each = max(1, int(BUCKET_BYTES / (chunk_rows * 4 * values)))
    return Plan(layout, first.skeleton, visits, entries, chunk_rows, chunk_rows * each)


def _load(source: Source) -> ClipRows:
    return source if isinstance(source, ClipRows) else load_clip_rows(source)


def _scatter(
    work: Path,
    clips: Mapping[str, Source],
    plan: Plan,
    seed: int,
    paces: Mapping[str, Pace],
    sources: Mapping[str, str],
) -> tuple[dict[str, Buckets], tuple[Moments, Moments]]:
    """Pass 1: every clip into its split's buckets, and the moments and the pace of the clips in training."""
    layout = plan.layout
    columns, of_fits = x_columns(layout) + layout.y_size, fit_columns(layout)
    buckets, places, done = {}, {}, dict.fromkeys(SPLITS, 0)
    for number, split in enumerate(SPLITS):
        rows = plan.rows(split)
        buckets[split] = Buckets(work / f"buckets-{split}", rows, plan.bucket_rows, columns, of_fits)
        places[split] = np.random.default_rng([seed, number]).permutation(rows)
    x = y = None
    for number, entry in enumerate(plan.clips):
        clip, split = _load(clips[entry["clip"]]), entry["split"]
        if split == "train":
            x_clip, y_clip = clip_moments(clip, layout)
            x, y = (x_clip, y_clip) if x is None or y is None else (x + x_clip, y + y_clip)
            gather(paces, clip, sources.get(entry["clip"]))
        index = np.zeros(len(clip), INDEX)
        index["place"] = places[split][done[split] : done[split] + len(clip)]
        index["count"], index["clip"] = clip.fits, number
        index["frame"], index["phase"] = clip.frame, clip.p
        for start in range(0, len(clip), PART_ROWS):
            buckets[split].add(
                *_tables(clip, slice(start, start + PART_ROWS), layout),
                index[start : start + PART_ROWS],
            )
        done[split] += len(clip)
    assert x is not None
    assert y is not None
    return buckets, (x, y)


def _tables(clip: ClipRows, part: slice, layout: RowLayout) -> tuple[Array, Array]:
    """The frames and fits of a part of a clip's rows, raw."""
    told = {name: clip.channels[name][part] for name, _ in layout.channels}
    frames = np.concatenate([frame_inputs(layout, clip.x[part], told), clip.y[part]], axis=1)
    first = clip.first_fit[part]
    ground = slice(int(first[0]), int(first[-1] + clip.fits[part][-1]))
    return frames, np.concatenate([clip.heights[ground], clip.mean[ground, None]], axis=1)


def _chunks(
    work: Path, split: str, buckets: Buckets, plan: Plan, statistics: Statistics, dtype: str
) -> Iterator[Chunk]:
    """Pass 2: each bucket in order, standardised, as chunks of `chunk_rows` rows."""
    number, columns = 0, x_columns(plan.layout)
    for frames, fits, index in buckets.drain():
        ends = np.cumsum(index["count"])
        for start in range(0, len(index), plan.chunk_rows):
            part = slice(start, min(start + plan.chunk_rows, len(index)))
            count = index["count"][part]
            fit_part = slice(int(ends[start] - count[0]), int(ends[part.stop - 1]))
            raw = frames[part, :columns], frames[part, columns:], fits[fit_part]
            x, y, ground = split_rows(plan.layout, statistics, *raw, count)
            arrays = {
                "x": narrow(x, dtype),
                "y": narrow(y, dtype),
                "fits": narrow(ground, dtype),
                "count": count,
                "clip": index["clip"][part],
                "frame": index["frame"][part],
                "phase": index["phase"][part],
            }
            yield write_chunk(work, f"{split}/{number:05d}.safetensors", arrays)
            number += 1


def _name(work: Path, chunks: Mapping[str, list[Chunk]]) -> str:
    """A name for the build that its content determines."""
    digest = hashlib.sha256((work / STATISTICS).read_bytes())
    digest.update(repr(chunks).encode())
    return f"rows-{digest.hexdigest()[:12]}"


def _original_bytes(plan: Plan) -> int:
    """What the same pairs take where every one is a row of X, Y and P in float32, as in the original."""
    values = plan.layout.x_size + plan.layout.y_size + 1
    return 4 * values * plan.visits * sum(clip["rows"] for clip in plan.clips)


def _publish(path: Path, work: Path, manifest: Manifest) -> None:
    """Give the finished build its name, let the manifest point to it, then remove the build before."""
    for leftover in work.glob("buckets-*"):
        leftover.rmdir()
    final = path / manifest.folder
    if final.exists():  # the same rows were built before: put each file in its place, whole or damaged
        for file in sorted(p for p in work.rglob("*") if p.is_file()):
            place = final / file.relative_to(work)
            place.parent.mkdir(parents=True, exist_ok=True)  # a kill may have left half a removed build
            os.replace(file, place)
        sync_folder(final)
    else:
        os.rename(work, final)
    manifest.save(path)
    _sweep(path, keep=manifest.folder)
