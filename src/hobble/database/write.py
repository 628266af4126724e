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
from dataclasses import replace
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
from hobble.database.order import first_fits
from hobble.database.statistics import (
    Moments,
    Statistics,
    clip_moments,
    standardise_rows,
    statistics_of_moments,
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


def plan_clips(
    clips: Mapping[str, RowSource],
    splits: Mapping[str, str],
    sources: Mapping[str, str],
    hurt_every: Mapping[str, int],
    every: int,
) -> tuple[list[dict[str, Any]], Outline, int]:
    """The entries of the clips for the manifest, the outline of the first clip, and the visits to each row.

    If an entry has `every` and `first_row`, only each `every`-th row from row `first_row` on is used. The
    arguments are those of `write_database`. Raises InputError if the rows of a clip have other columns or
    joints than those of the first clip, and HobbleError if no training clip has rows.
    """
    entries: list[dict[str, Any]] = []
    first, visits = None, 1
    # Healthy clip -> number of its hurt versions so far. Each version begins at another row, so that the
    # versions of a clip use different frames.
    versions: Counter[str] = Counter()
    for name in sorted(clips):
        source, outline = clips[name], read_outline(clips[name])
        first = first or outline
        if _columns(outline) != _columns(first):
            where = name if isinstance(source, ClipRows) else source
            raise InputError(where, f"the layout of its rows differs from that of {min(clips)}")
        entry: dict[str, Any] = {"clip": name, "split": splits[name]}
        step, start = every if splits[name] == "train" else 1, 0
        if name in sources:
            entry["source"] = sources[name]
            if splits[name] == "train":
                steps = hurt_every.get(name, 1)
                step, start = every * steps, every * (versions[sources[name]] % steps)
                versions[sources[name]] += 1
        if step > 1:
            entry |= {"every": step, "first_row": start}
        fits = outline.fits[start::step]
        entries.append(entry | {"rows": len(fits), "pairs": int(fits.sum())})
        visits = max(visits, outline.visits, int(fits.max(initial=1)))
    if first is None or not any(entry["rows"] for entry in entries if entry["split"] == "train"):
        raise HobbleError(
            "There is nothing to train on: no training clip has a whole locomotion cycle. Add clips, or list "
            "fewer under held_out."
        )
    return entries, first, visits


def _columns(outline: Outline) -> tuple[RowLayout, list[str]]:
    """What the columns of the rows are: their layout, and the names of the joints."""
    return outline.layout, list(outline.skeleton["joints"])


# Buckets: files that help to shuffle the rows of a database, which may be more than fit in memory.
#
# The random order in which the rows are stored, the final order, is cut into stretches. Each bucket collects
# the rows of one stretch on disk, and later these few rows are sorted in memory. A bucket has two files: its
# rows, and their terrain fits.


def row_type(columns: int) -> np.dtype[Any]:
    """The type of a row in a bucket.

    place: in the final order. count: number of terrain fits. clip: number of the clip. frame: in this clip.
    values: the columns of X without terrain, then those of Y.
    """
    index = [("place", "<i8"), ("count", "<i4"), ("clip", "<i4"), ("frame", "<i4"), ("phase", "<f4")]
    return np.dtype([*index, ("values", "<f4", (columns,))])


def gather_fits(fits: Array, count: np.ndarray, order: np.ndarray) -> Array:
    """The terrain fits (n, columns) of the rows with the indices `order`, in the order of these rows.

    fits: (S, columns) fits of R rows, row after row. count: (R,) number of fits of each row.
    """
    chosen = count[order]
    first_in_result = first_fits(chosen)
    return fits[np.repeat(first_fits(count)[order] - first_in_result, chosen) + np.arange(chosen.sum())]


def add_to_buckets(folder: Path, rows_per_bucket: int, rows: np.ndarray, fits: Array) -> None:
    """Add rows of `row_type`, with their fits (S, columns) row after row, to the buckets in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    bucket_of_row = rows["place"] // rows_per_bucket
    for bucket in np.unique(bucket_of_row):
        chosen = np.flatnonzero(bucket_of_row == bucket)
        fits_of_rows = np.asarray(gather_fits(fits, rows["count"], chosen), "<f4")
        for table, values in (("rows", rows[chosen]), ("fits", fits_of_rows)):
            with open(folder / f"{bucket:08d}.{table}", "ab") as file:
                file.write(values.tobytes())


def drain_buckets(folder: Path, row: np.dtype[Any], fit_columns: int) -> Iterator[tuple[np.ndarray, Array]]:
    """Yield the rows and fits of each bucket in the final order. Removes the files once read."""
    for file in sorted(folder.glob("*.rows")):
        rows, fits = np.fromfile(file, row), np.fromfile(file.with_suffix(".fits"), "<f4")
        file.unlink()
        file.with_suffix(".fits").unlink()
        order = np.argsort(rows["place"])
        yield rows[order], gather_fits(fits.reshape(-1, fit_columns), rows["count"], order)


# First step of the shuffle: scatter the rows of clips over buckets. Each row has a random place in the final
# order of its split.


PART_ROWS = 8192  # rows of a clip are scattered so many at a time, to use little memory


def scatter(
    folder: Path, clips: Mapping[str, RowSource], manifest: Manifest, bucket_rows: int, seed: int
) -> Iterator[tuple[dict[str, Any], ClipRows, ClipRows]]:
    """Put the used rows of each clip into the buckets in the subfolder of `folder` for the clip's split.

    clips: name -> rows or their file. bucket_rows: rows of a bucket. seed: of the random places. Yields (the
    clip's entry in the manifest, all its rows, its used rows) for each clip.
    """
    places = {
        split: np.random.default_rng([seed, number]).permutation(manifest.row_count(split))
        for number, split in enumerate(SPLITS)
    }
    for number, entry in enumerate(manifest.clips):
        source = clips[entry["clip"]]
        whole = source if isinstance(source, ClipRows) else load_clip_rows(source)
        used = whole.part(slice(entry["first_row"], None, entry["every"])) if "every" in entry else whole
        place, places[entry["split"]] = np.split(places[entry["split"]], [len(used)])
        for first in range(0, len(used), PART_ROWS):
            part = slice(first, min(first + PART_ROWS, len(used)))
            rows = np.zeros(part.stop - first, row_type(_row_columns(manifest.layout)))
            rows["place"], rows["count"], rows["clip"] = place[part], used.fits[part], number
            rows["frame"], rows["phase"] = used.frame[part], used.p[part]
            values = {name: used.channels[name][part] for name, _ in manifest.layout.channels}
            x = frame_inputs(manifest.layout, used.x[part], values)
            rows["values"] = np.concatenate([x, used.y[part, : manifest.layout.y_size]], axis=1)
            first_fit = used.first_fit[part]
            ground = slice(int(first_fit[0]), int(first_fit[-1] + used.fits[part][-1]))
            fits = np.concatenate([used.heights[ground], used.mean[ground, None]], axis=1)
            add_to_buckets(folder / entry["split"], bucket_rows, rows, fits)
        yield entry, whole, used


def _row_columns(layout: RowLayout) -> int:
    """Number of values of a row in a bucket: X without terrain, and Y."""
    return column_count_without_terrain(layout) + layout.y_size


# Second step of the shuffle: sort the rows of each bucket, standardise them and write them as chunks.


def write_chunks(
    folder: Path, split: str, buckets: Path, manifest: Manifest, statistics: Statistics, chunk_rows: int
) -> Iterator[Chunk]:
    """Write the rows of one split, standardised, to chunk files in the subfolder `split` of `folder`.

    A chunk has up to `chunk_rows` rows of one bucket. split: "train" or "held_out". buckets: the folder of
    the buckets. Their files are deleted. Yields a description of each chunk.
    """
    layout, number = manifest.layout, 0
    columns, row = column_count_without_terrain(layout), row_type(_row_columns(layout))
    for rows, fits in drain_buckets(buckets / split, row, fit_column_count(layout)):
        ends = np.cumsum(rows["count"])
        for start in range(0, len(rows), chunk_rows):
            part = rows[start : start + chunk_rows]
            ground = fits[int(ends[start] - part["count"][0]) : int(ends[start + len(part) - 1])]
            raw = part["values"][:, :columns], part["values"][:, columns:], ground
            tables = standardise_rows(layout, statistics, *raw, part["count"])
            x, y, lifted = (to_stored_type(table, manifest.dtype) for table in tables)
            index = {name: part[name].copy() for name in ("count", "clip", "frame", "phase")}
            arrays = {"x": x, "y": y, "fits": lifted, **index}
            yield write_chunk(folder, f"{split}/{number:05d}.safetensors", arrays)
            number += 1


# Bytes of a chunk. A chunk is read in one go, so it is large enough for slow disks and small for any memory.
CHUNK_BYTES = 4 << 20


def make_limit_learners(layout: RowLayout, skeleton: Mapping[str, Any]) -> dict[str, LimitLearner]:
    """For each channel of the layout whose values slow a body: its name -> a learner of its speed limits.

    skeleton: see `Skeleton.to_dict`.
    """
    rig = Skeleton.from_dict(skeleton)
    return {
        name: LimitLearner(slow.highest, _other_side(slow, columns, rig), len(GAITS))
        for name, columns in layout.channels
        if (slow := channel(name)).slows
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
    if not len(rows):
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
    local_phases: bool = False,
    sources: Mapping[str, str] | None = None,
    hurt_every: Mapping[str, int] | None = None,
    every: int = 1,
    joint_weight: float,
    dtype: Precision = "float32",
    seed: int = 1,
    chunk_bytes: int = CHUNK_BYTES,
) -> Manifest:
    """Build a database in the folder `path`. Returns its manifest, which is written last.

    clips: clip name -> its rows, or the file with them. splits: clip name -> "train" or "held_out". channels:
    the network's input channels, in the order of their columns. local_phases: whether the network uses those
    that the rows have. sources: name of a hurt version -> name of the healthy clip from which it was
    computed. every: training uses only each `every`-th row of a clip. hurt_every: name of a hurt version ->
    n: of these rows, training uses only each n-th. joint_weight: factor of the standardised joints in the
    network's input. dtype: type of the numbers on disk. seed: seed of the order of the rows. chunk_bytes:
    rough size of a chunk. The statistics are those of the training clips. The same rows and options give the
    same bytes. Raises HobbleError if no training clip has rows, InputError if the rows of the clips differ in
    columns or joints.
    """
    entries, first, visits = plan_clips(clips, splits, sources or {}, hurt_every or {}, every)
    layout, rows = first.layout.with_channels(channels, local_phases), sum(entry["rows"] for entry in entries)
    manifest = Manifest(
        folder="",
        layout=layout,
        skeleton=first.skeleton,
        visits=visits,
        dtype=dtype,
        joint_weight=joint_weight,
        clips=entries,
        chunks={},
        original_bytes=4 * (layout.x_size + layout.y_size + 1) * visits * rows,  # X, Y and the phase
        bytes=0,
    )
    # How many numbers a row has on average, with its fits.
    pairs = sum(entry["pairs"] for entry in entries)
    numbers = _row_columns(layout) + fit_column_count(layout) * pairs / rows
    chunk_rows = max(1, int(chunk_bytes / (STORED[dtype].itemsize * numbers + INDEX_BYTES)))
    bucket_rows = chunk_rows * max(1, int(BUCKET_BYTES / (chunk_rows * 4 * numbers)))
    with _work_folder(Path(path)) as work:
        learners = make_limit_learners(layout, first.skeleton)
        x, y = Moments.of_no_rows(layout.x_size), Moments.of_no_rows(layout.y_size)
        for entry, whole, used in scatter(work, clips, manifest, bucket_rows, seed):
            if entry["split"] == "train":
                x_of_clip, y_of_clip = clip_moments(used, layout)
                x, y = x + x_of_clip, y + y_of_clip
                # Also rows left out of training, because a speed is the mean over all rows of a gait cycle.
                add_rows(learners, whole, entry.get("source"))
        statistics = statistics_of_moments(layout, x, y, joint_weight, first.skeleton)
        build = work / "rows"
        chunks = {
            split: list(write_chunks(build, split, work, manifest, statistics, chunk_rows))
            for split in SPLITS
        }
        save_npz(build / STATISTICS, **vars(statistics))
        content = (build / STATISTICS).read_bytes() + repr(chunks).encode()
        manifest = replace(
            manifest,
            folder=f"rows-{hashlib.sha256(content).hexdigest()[:12]}",
            chunks=chunks,
            bytes=sum(chunk.bytes for split in SPLITS for chunk in chunks[split]),
            limits={name: learnt.to_dict() for name, each in learners.items() if (learnt := each.learn())},
        )
        final = Path(path) / manifest.folder
        if final.is_dir():  # the same rows of an earlier build, maybe damaged
            _replace_files(build, final)
        else:
            os.rename(build, final)
        manifest.save(Path(path))
        for other in Path(path).iterdir():  # earlier builds, and what killed ones left
            if other.is_dir() and other.name != manifest.folder:
                shutil.rmtree(other, ignore_errors=True)
        return manifest


def _replace_files(new: Path, old: Path) -> None:
    """Replace each file in the folder `old` by the one in `new`, which has the same rows.

    At every moment each file is there, because the manifest may already name this folder.
    """
    for file in [path for path in new.rglob("*") if path.is_file()]:
        target = old / file.relative_to(new)
        target.parent.mkdir(exist_ok=True)
        os.replace(file, target)


@contextlib.contextmanager
def _work_folder(path: Path) -> Iterator[Path]:
    """Make a folder for unfinished files in the database's folder `path`, and remove it at the end.

    Raises HobbleError for a file that cannot be written.
    """
    work = path / f"part-{os.getpid()}"
    shutil.rmtree(work, ignore_errors=True)  # of a killed build
    work.mkdir(parents=True)
    try:
        yield work
    except OSError as error:
        raise failed_write_error(error, path) from error
    finally:
        shutil.rmtree(work, ignore_errors=True)


# Refuses a split that trains on a motion and also holds it out: its error says nothing about new motion.


MOST_NAMED = 10  # a message names at most this many pairs of clips


def refuse_split_pairs(where: str, pairs: Iterable[tuple[str, str, str]], splits: Mapping[str, str]) -> None:
    """Raise HobbleError if, of two clips with the same motion, one is trained on and the other held out.

    where: the data set's name for messages. pairs: (clip, clip, in what they are alike, such as "the same
    file"). splits: clip -> "train" or "held_out". Pairs with a clip that is not in `splits` are ignored.
    """
    # Held-out clip, clip in training, and in what they are alike.
    split_pairs = [
        ((a, b) if splits[a] == "held_out" else (b, a)) + (likeness,)
        for a, b, likeness in pairs
        if {splits.get(a), splits.get(b)} == set(SPLITS)
    ]
    if not split_pairs:
        return
    said = [f"{held_out} and {trained} are {likeness}" for held_out, trained, likeness in split_pairs]
    more = f" and {len(said) - MOST_NAMED} more pairs" if len(said) > MOST_NAMED else ""
    names = ", ".join(f'"{name}"' for name in dict.fromkeys(trained for _, trained, _ in split_pairs))
    raise HobbleError(
        f"{where}: {'; '.join(said[:MOST_NAMED])}{more}. The first clip of each pair is held out and "
        "the second is trained on, so the network would learn a motion that is held out. Add the second ones "
        f"to held_out: [{names}], or take one clip of each pair out of the data set."
    )
