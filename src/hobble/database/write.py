"""Writes a database: plans it, shuffles the rows of all clips in bounded memory, and writes them in chunks.

A row is a frame of a clip as a network gets it, with one or more terrain fits (ground heights that suit the
motion). Chunks are files with some of the rows. Buckets are temporary files in which the rows are
sorted before chunks are written.
"""

import contextlib
import hashlib
import os
import shutil
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.channel import Channel
from hobble.channels.speed_limits import LimitLearner
from hobble.core.errors import HobbleError, InputError
from hobble.core.files import failed_write_error, save_npz
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.database.chunks import (
    FILE,
    INDEX_BYTES,
    SPLITS,
    STATISTICS,
    STORED,
    Chunk,
    Manifest,
    Precision,
    to_stored_type,
    write_chunk,
)
from hobble.database.statistics import (
    Moments,
    Statistics,
    clip_moments,
    standardise_rows,
    statistics_of_moments,
    unseen_joints,
)
from hobble.rows.clip_rows import ClipRows, Outline, load_clip_rows, read_outline
from hobble.rows.layout import (
    GAITS,
    RowLayout,
    body_layout,
    column_count_without_terrain,
    fit_column_count,
    frame_inputs,
)

# Bytes of a bucket. Sorting a bucket needs a few times as much memory.
BUCKET_BYTES = 64 << 20

# The rows of a clip, or the path of the file with them.
RowSource = ClipRows | str | Path


@dataclass(frozen=True)
class Plan:
    """What a database will contain.

    layout: the columns of its rows. skeleton: see `Skeleton.to_dict`. visits: how often a pass over the data
    uses each row. clips: one entry for each clip: `clip` (its name), `split`, number of used `rows` and of
    `pairs` (of a used row and one of its terrain fits), and for a hurt version `source`, the name of the
    healthy clip from which it was computed. If an entry has `every` and `first_row`, only each `every`-th row
    from row `first_row` on is used. chunk_rows, bucket_rows: number of rows of a chunk and of a bucket.
    """

    layout: RowLayout
    skeleton: Mapping[str, Any]
    visits: int
    clips: list[dict[str, Any]]
    chunk_rows: int
    bucket_rows: int

    def row_count(self, split: str) -> int:
        """Number of used rows in a split ("train" or "held_out")."""
        return sum(clip["rows"] for clip in self.clips if clip["split"] == split)


def make_plan(
    clips: Mapping[str, RowSource],
    splits: Mapping[str, str],
    channels: Sequence[str],
    number_bytes: int,
    chunk_bytes: int,
    sources: Mapping[str, str],
    hurt_every: int = 1,
    every: int = 1,
) -> Plan | None:
    """The plan of a database with the rows of `clips`; None if there are no clips.

    number_bytes: bytes of a number on disk. For the other arguments see
    `write_database`. Raises InputError if the rows of a clip have other columns or
    joints than those of the first clip.
    """
    entries: list[dict[str, Any]] = []
    first: Outline | None = None
    visits, pairs, rows = 1, 0, 0
    # Healthy clip -> number of its hurt versions so far. Each version begins at another row, so that the
    # versions of a clip use different frames.
    versions: Counter[str] = Counter()
    for name in sorted(clips):
        current = read_outline(clips[name])
        first = first or current
        if not have_same_columns(current, first):
            source = clips[name]
            where = name if isinstance(source, ClipRows) else source
            raise InputError(where, f"the layout of its rows differs from that of {min(clips)}")
        entry: dict[str, Any] = {"clip": name, "split": splits[name]}
        step, start = 1, 0
        if splits[name] == "train":
            step = every
            if name in sources:
                step, start = every * hurt_every, every * (versions[sources[name]] % hurt_every)
                versions[sources[name]] += 1
        if name in sources:
            entry["source"] = sources[name]
        if step > 1:
            entry |= {"every": step, "first_row": start}
        fits = current.fits[used_rows(entry)]
        entries.append(entry | {"rows": len(fits), "pairs": int(fits.sum())})
        visits = max(visits, current.visits, int(fits.max(initial=1)))
        rows, pairs = rows + len(fits), pairs + int(fits.sum())
    if first is None:
        return None
    layout = first.layout.with_channels(channels)
    # How many numbers a row has on average, with its fits.
    row_numbers = (
        column_count_without_terrain(layout) + layout.y_size + fit_column_count(layout) * pairs / max(rows, 1)
    )
    chunk_rows = max(1, int(chunk_bytes / (number_bytes * row_numbers + INDEX_BYTES)))
    bucket_chunks = max(1, int(BUCKET_BYTES / (chunk_rows * 4 * row_numbers)))
    return Plan(layout, first.skeleton, visits, entries, chunk_rows, chunk_rows * bucket_chunks)


def used_rows(entry: Mapping[str, Any]) -> slice:
    """The rows of a clip that are used, as a slice. entry: the clip's entry in `Plan.clips`."""
    return slice(entry.get("first_row", 0), None, entry.get("every", 1))


def have_same_columns(one: Outline | Plan, other: Outline | Plan) -> bool:
    """Whether the rows of `one` and `other` have the same columns and joints."""
    return one.layout == other.layout and list(one.skeleton["joints"]) == list(other.skeleton["joints"])


# Buckets: files that help to shuffle the rows of a database, which may be more than fit in memory.
#
# The random order in which the rows are stored, the final order, is cut into stretches. Each bucket collects
# the rows of one stretch on disk, and later these few rows are sorted in memory.


# For each row: its place in the final order, its number of terrain fits, the number of its clip, its frame in
# this clip, and its phase.
ROW_INDEX = np.dtype(
    [("place", "<i8"), ("count", "<i4"), ("clip", "<i4"), ("frame", "<i4"), ("phase", "<f4")]
)


def gather_fits(fits: Array, count: np.ndarray, order: np.ndarray) -> Array:
    """The terrain fits (n, columns) of the rows with the indices `order`, in the order of these rows.

    fits: (S, columns) fits of R rows, row after row. count: (R,) number of fits of each row.
    """
    first = np.cumsum(count) - count  # index in `fits` of each row's first fit
    chosen = count[order]
    first_in_result = np.cumsum(chosen) - chosen
    return fits[np.repeat(first[order] - first_in_result, chosen) + np.arange(chosen.sum())]


class Buckets:
    """The buckets in a folder, each with the rows of `rows_per_bucket` consecutive places in the final order.

    Rows can be added in any order. rows: number of all rows. columns, fit_columns: number of columns of a row
    and of a terrain fit. A bucket has three files, called tables here: "frames" (the rows), "fits" and
    "index". count: number of buckets.
    """

    def __init__(self, folder: Path, rows: int, rows_per_bucket: int, columns: int, fit_columns: int) -> None:
        self.folder, self.rows_per_bucket = folder, rows_per_bucket
        self.columns, self.fit_columns = columns, fit_columns
        self.count = -(-rows // rows_per_bucket)  # rounded up
        folder.mkdir(parents=True)

    def add(self, frames: Array, fits: Array, index: np.ndarray) -> None:
        """Add R rows, with S terrain fits together, to their buckets.

        frames: (R, columns) the rows. fits: (S, fit_columns) their fits, row after row. index: (R,) of type
        ROW_INDEX.
        """
        of_rows = index["place"] // self.rows_per_bucket
        order = np.argsort(of_rows, kind="stable")
        edges = np.searchsorted(of_rows[order], np.arange(self.count + 1))
        for bucket in np.unique(of_rows):
            rows = order[edges[bucket] : edges[bucket + 1]]
            self._append(bucket, "frames", np.asarray(frames[rows], "<f4"))
            self._append(bucket, "fits", np.asarray(gather_fits(fits, index["count"], rows), "<f4"))
            self._append(bucket, "index", index[rows])

    def _append(self, bucket: int, table: str, values: np.ndarray) -> None:
        with open(self._file(bucket, table), "ab") as file:
            file.write(values.tobytes())

    def _file(self, bucket: int, table: str) -> Path:
        return self.folder / f"{bucket:05d}.{table}"

    def drain(self) -> Iterator[tuple[Array, Array, np.ndarray]]:
        """Yield the frames, fits and index of each bucket in the final order. Removes the files once read."""
        for bucket in range(self.count):
            frames, fits = self._take(bucket, "frames", "<f4"), self._take(bucket, "fits", "<f4")
            index = self._take(bucket, "index", ROW_INDEX)
            order = np.argsort(index["place"])
            fits = gather_fits(fits.reshape(-1, self.fit_columns), index["count"], order)
            yield frames.reshape(-1, self.columns)[order], fits, index[order]

    def _take(self, bucket: int, table: str, dtype: Any) -> np.ndarray:
        """Read a table, and remove its file."""
        values = np.fromfile(file := self._file(bucket, table), dtype)
        file.unlink()
        return values


# First step of the shuffle: scatter the rows of clips over buckets. Each row has a random place in the final
# order of its split.


PART_ROWS = 8192  # rows of a clip are scattered so many at a time, to use little memory


def make_buckets(folder: Path, plan: Plan) -> dict[str, Buckets]:
    """Empty buckets for each split, in subfolders of `folder`."""
    columns, fit_size = (
        column_count_without_terrain(plan.layout) + plan.layout.y_size,
        fit_column_count(plan.layout),
    )
    return {
        split: Buckets(
            folder / f"buckets-{split}", plan.row_count(split), plan.bucket_rows, columns, fit_size
        )
        for split in SPLITS
    }


def scatter(
    buckets: Mapping[str, Buckets], clips: Mapping[str, RowSource], plan: Plan, seed: int
) -> Iterator[tuple[dict[str, Any], ClipRows, ClipRows]]:
    """Put the rows of each clip that the plan uses into the buckets of the clip's split.

    clips: name -> rows or their file. seed: of the random places. Yields (the clip's entry in `Plan.clips`,
    all its rows, its used rows) for each clip.
    """
    places = {
        split: np.random.default_rng([seed, number]).permutation(plan.row_count(split))
        for number, split in enumerate(SPLITS)
    }
    done = dict.fromkeys(SPLITS, 0)  # rows of each split that already have a place
    for number, entry in enumerate(plan.clips):
        split, start = entry["split"], done[entry["split"]]
        done[split] += entry["rows"]
        source = clips[entry["clip"]]
        whole = source if isinstance(source, ClipRows) else load_clip_rows(source)
        used = used_rows(entry)
        rows = whole if used.step == 1 else whole.every(used.step, used.start)
        index = np.zeros(len(rows), ROW_INDEX)
        index["place"] = places[split][start : done[split]]
        index["count"], index["clip"] = rows.fits, number
        index["frame"], index["phase"] = rows.frame, rows.p
        for first in range(0, len(rows), PART_ROWS):
            part = slice(first, first + PART_ROWS)
            buckets[split].add(*_frames_and_fits(rows, part, plan.layout), index[part])
        yield entry, whole, rows


def _frames_and_fits(clip: ClipRows, part: slice, layout: RowLayout) -> tuple[Array, Array]:
    """Some rows of a clip, not standardised, as two arrays for `Buckets.add`: frames and fits.

    part: which n rows. Frames (n, columns): the columns of X without terrain, then those of Y. Fits (m,
    columns): a line for each terrain fit of these rows, with the ground heights, then their mean on the path.
    """
    values = {name: clip.channels[name][part] for name, _ in layout.channels}
    frames = np.concatenate([frame_inputs(layout, clip.x[part], values), clip.y[part]], axis=1)
    first = clip.first_fit[part]
    ground = slice(int(first[0]), int(first[-1] + clip.fits[part][-1]))
    return frames, np.concatenate([clip.heights[ground], clip.mean[ground, None]], axis=1)


# Second step of the shuffle: sort the rows of each bucket, standardise them and write them as chunks.


def write_chunks(
    folder: Path, split: str, buckets: Buckets, plan: Plan, statistics: Statistics, dtype: str
) -> Iterator[Chunk]:
    """Write the rows of one split, standardised, to chunk files in the subfolder `split` of `folder`.

    A chunk has up to `plan.chunk_rows` rows of one bucket. split: "train" or "held_out". buckets: the rows.
    They are deleted. dtype: type of the stored numbers. Yields a description of each chunk.
    """
    columns, number = column_count_without_terrain(plan.layout), 0
    for frames, fits, index in buckets.drain():  # one bucket at a time, sorted
        ends = np.cumsum(index["count"])
        for start in range(0, len(index), plan.chunk_rows):
            part = slice(start, min(start + plan.chunk_rows, len(index)))
            count = index["count"][part]
            fit_part = slice(int(ends[start] - count[0]), int(ends[part.stop - 1]))
            raw = frames[part, :columns], frames[part, columns:], fits[fit_part]
            x, y, ground = standardise_rows(plan.layout, statistics, *raw, count)
            arrays = {
                "x": to_stored_type(x, dtype),
                "y": to_stored_type(y, dtype),
                "fits": to_stored_type(ground, dtype),
                "count": count,
                "clip": index["clip"][part],
                "frame": index["frame"][part],
                "phase": index["phase"][part],
            }
            yield write_chunk(folder, f"{split}/{number:05d}.safetensors", arrays)
            number += 1


# Bytes of a chunk. A chunk is read in one go, so it is large enough for slow disks and small for any memory.
CHUNK_BYTES = 4 << 20


def make_limit_learners(layout: RowLayout, skeleton: Mapping[str, Any]) -> dict[str, LimitLearner]:
    """For each channel of the layout whose values slow a body: its name -> a learner of its speed limits.

    skeleton: see `Skeleton.to_dict`.
    """
    slowing = [(slow, columns) for name, columns in layout.channels if (slow := channel(name)).slows]
    if not slowing:
        return {}
    rig = Skeleton.from_dict(skeleton)
    return {
        slow.name: LimitLearner(slow.highest, _other_side(slow, columns, rig), len(GAITS))
        for slow, columns in slowing
    }


def _other_side(slow: Channel, columns: int, rig: Skeleton) -> np.ndarray:
    """(columns,) for each column of a channel, the index of the column for the other side of the body.

    If the rig does not pair left and right, each column gets its own index, so that the limits of both sides
    are learnt separately.
    """
    # The channel mirrors values, so a row with the indices of the columns shows which columns swap.
    numbers = np.arange(columns, dtype=float)
    try:
        return slow.mirror(numbers[None], rig)[0].astype(int)
    except HobbleError:
        return numbers.astype(int)


def add_rows(learners: Mapping[str, LimitLearner], rows: ClipRows, source: str | None) -> None:
    """Add the rows of a clip to all learners.

    source: for a hurt version (a clip computed from a healthy clip), the name of the healthy clip; else None.
    """
    if not learners or not len(rows):
        return
    layout = rows.layout
    shares = rows.x[:, body_layout(layout).x_gait].reshape(len(rows), len(GAITS), layout.samples)
    is_above_0 = {name: rows.channels[name].any(axis=1) for name, _ in layout.channels if channel(name).slows}
    for name, learner in learners.items():
        others = [above_0 for other, above_0 in is_above_0.items() if other != name]
        learner.add(
            rows.clip,
            gait=shares[:, :, layout.samples // 2],  # the sample in the middle is the present frame
            velocity=rows.y[:, layout.y_root_velocity],
            values=rows.channels[name],
            cycle=rows.cycle,
            others=np.any(others, axis=0) if others else np.zeros(len(rows), bool),
            source=source,
        )


def write_database(
    path: str | Path,
    clips: Mapping[str, RowSource],
    splits: Mapping[str, str],
    *,
    channels: Sequence[str],
    sources: Mapping[str, str] | None = None,
    hurt_every: int = 1,
    every: int = 1,
    joint_weight: float,
    dtype: Precision = "float32",
    seed: int = 1,
    chunk_bytes: int = CHUNK_BYTES,
) -> Manifest:
    """Build a database in the folder `path`. Returns its manifest, which is written last.

    clips: clip name -> its rows, or the file with them. splits: clip name -> "train" or "held_out". channels:
    the network's input channels, in the order of their columns. sources: name of a hurt version -> name of
    the healthy clip from which it was computed. every: training uses only each `every`-th row of a clip, and
    of these only each `hurt_every`-th of a hurt version. joint_weight: factor of the standardised joints in
    the network's input. dtype: type of the numbers on disk. seed: seed of the order of the rows. chunk_bytes:
    rough size of a chunk. The statistics are those of the training clips. The same rows and options give the
    same bytes.
    Raises HobbleError if no training clip has rows, InputError if the rows of the clips differ in columns or
    joints.
    """
    number_bytes = STORED[dtype].itemsize
    plan = make_plan(clips, splits, channels, number_bytes, chunk_bytes, sources or {}, hurt_every, every)
    if plan is None or not plan.row_count("train"):
        raise HobbleError(
            "There is nothing to train on: no training clip has a whole locomotion cycle. Add clips, or list "
            "fewer under held_out."
        )
    with _work_folder(Path(path)) as work:
        build = work / "rows"
        buckets = make_buckets(work, plan)
        learners = make_limit_learners(plan.layout, plan.skeleton)
        x, y = Moments.of_no_rows(plan.layout.x_size), Moments.of_no_rows(plan.layout.y_size)
        for entry, rows, used in scatter(buckets, clips, plan, seed):
            if entry["split"] == "train":
                x_of_clip, y_of_clip = clip_moments(used, plan.layout)
                x, y = x + x_of_clip, y + y_of_clip
                # Also rows left out of training, because a speed is the mean over all rows of a gait cycle.
                add_rows(learners, rows, (sources or {}).get(entry["clip"]))
        statistics = statistics_of_moments(plan.layout, x, y, joint_weight, unseen_joints(plan.skeleton))
        chunks = {
            split: list(write_chunks(build, split, buckets[split], plan, statistics, dtype))
            for split in SPLITS
        }
        save_npz(build / STATISTICS, **vars(statistics))
        row_numbers = plan.layout.x_size + plan.layout.y_size + 1  # numbers in a row: X, Y and the phase
        manifest = Manifest(
            folder=_folder_name(build, chunks),
            layout=plan.layout,
            skeleton=plan.skeleton,
            visits=plan.visits,
            dtype=dtype,
            joint_weight=joint_weight,
            clips=plan.clips,
            chunks=chunks,
            original_bytes=4 * row_numbers * plan.visits * sum(entry["rows"] for entry in plan.clips),
            bytes=sum(chunk.bytes for split in SPLITS for chunk in chunks[split]),
            limits={name: learnt.to_dict() for name, each in learners.items() if (learnt := each.learn())},
        )
        _put_in_place(Path(path), build, manifest)
        return manifest


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
    digest = hashlib.sha256((build / STATISTICS).read_bytes())
    digest.update(repr(chunks).encode())
    return f"rows-{digest.hexdigest()[:12]}"


def _put_in_place(path: Path, build: Path, manifest: Manifest) -> None:
    """Move the folder `build` to its final name, write the manifest, then remove the previous build."""
    final = path / manifest.folder
    if final.exists():  # the same rows were built before; some files may be damaged
        shutil.rmtree(final)
    os.rename(build, final)
    manifest.save(path)
    _remove_unused(path, keep=manifest.folder)


# Refuses a split that trains on a motion and also holds it out: its error says nothing about new motion.


MOST_NAMED = 10  # a message names at most this many pairs of clips


def refuse_split_pairs(where: str, pairs: Iterable[tuple[str, str, str]], splits: Mapping[str, str]) -> None:
    """Raise HobbleError if, of two clips with the same motion, one is trained on and the other held out.

    where: the data set's name for messages. pairs: (clip, clip, in what they are alike, such as "the same
    file"). splits: clip -> "train" or "held_out". Pairs with a clip that is not in `splits` are ignored.
    """
    split_pairs, trained_clips = [], []
    for a, b, likeness in pairs:
        if {splits.get(a), splits.get(b)} == {"train", "held_out"}:
            held_out, trained = (a, b) if splits[a] == "held_out" else (b, a)
            split_pairs.append(f"{held_out} and {trained} are {likeness}")
            trained_clips.append(trained)
    if not split_pairs:
        return
    more = f" and {len(split_pairs) - MOST_NAMED} more pairs" if len(split_pairs) > MOST_NAMED else ""
    names = ", ".join(f'"{name}"' for name in dict.fromkeys(trained_clips))
    raise HobbleError(
        f"{where}: {'; '.join(split_pairs[:MOST_NAMED])}{more}. The first clip of each pair is held out and "
        "the second is trained on, so the network would learn a motion that is held out. Add the second ones "
        f"to held_out: [{names}], or take one clip of each pair out of the data set."
    )
