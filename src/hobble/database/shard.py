"""A shard: the rows of some clips of a database, shuffled and in chunks.

The job that makes a shard reads only its clips. The rows are standardised by the shard's own statistics, so
that half precision stores them well. The reader converts them to the statistics of the whole database
(`hobble.database.scale`). A shard numbers its own clips from 0. So it stays the same to the byte when another
shard changes.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from hobble.channels.speed_limits import LimitLearner
from hobble.core.errors import InputError
from hobble.core.files import load_npz, read_json, save_npz, write_error, write_json
from hobble.database.chunks import HINT, Chunk
from hobble.database.learn_limits import add_rows, make_limit_learners
from hobble.database.manifest import SPLITS
from hobble.database.plan import Plan, RowSource, make_plan
from hobble.database.precision import STORED
from hobble.database.scatter import make_buckets, scatter
from hobble.database.statistics import Moments, Statistics, clip_moments, statistics_of_moments, unseen_joints
from hobble.database.write_in_order import write_chunks

# Size of a chunk, which is read in one go: fast on any disk, and small enough for any memory.
CHUNK_BYTES = 4 << 20
INDEX, MOMENTS, SCALE = "shard.json", "moments.npz", "scale.npz"  # names of a shard's files
Sums = tuple[Moments, Moments]  # of the columns of X, and of Y


def write_shard(
    folder: Path,
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
) -> None:
    """Write the shard of `clips` to `folder`. Arguments as in `hobble.database.merge.write_database`.

    There may be no clips, or none with rows. Raises InputError if the rows of the clips differ in columns or
    joints, HobbleError if the disk is full.
    """
    plan = make_plan(clips, splits, channels, STORED[dtype].itemsize, chunk_bytes, sources or {}, every)
    try:
        for split in SPLITS:  # delete chunks, do not overwrite them: a database may have hard links to them
            shutil.rmtree(folder / split, ignore_errors=True)
        folder.mkdir(parents=True, exist_ok=True)
        if plan is None:
            write_json(folder / INDEX, {"plan": None, "chunks": {}})
            return
        buckets = make_buckets(folder, plan)
        nothing = Moments.nothing(plan.layout.x_size), Moments.nothing(plan.layout.y_size)
        sums: dict[str, Sums] = dict.fromkeys(SPLITS, nothing)
        learners = make_limit_learners(plan.layout, plan.skeleton)
        for entry, clip, used in scatter(buckets, clips, plan, seed):
            sums[entry["split"]] = add(sums[entry["split"]], clip_moments(used, plan.layout))
            if entry["split"] == "train":  # also rows left out of training: speeds are means of cycles
                add_rows(learners, clip, (sources or {}).get(entry["clip"]))
        # A shard with held-out rows only is standardised by these.
        of_rows = sums["train"] if sums["train"][0].weight else sums["held_out"]
        scale = statistics_of(plan, of_rows, joint_weight)
        chunks = {
            split: list(write_chunks(folder, split, buckets[split], plan, scale, dtype)) for split in SPLITS
        }
        for split in SPLITS:
            buckets[split].folder.rmdir()
        _save(folder, plan, sums["train"], scale, learners)
        of_split = {split: [asdict(chunk) for chunk in some] for split, some in chunks.items()}
        write_json(folder / INDEX, {"plan": plan.to_dict(), "chunks": of_split})
    except OSError as error:
        raise write_error(error, folder) from error


def add(one: Sums, other: Sums) -> Sums:
    """The moments of two sets of rows together."""
    return one[0] + other[0], one[1] + other[1]


def statistics_of(plan: Plan, sums: Sums, joint_weight: float) -> Statistics:
    """The statistics of rows with these moments."""
    return statistics_of_moments(plan.layout, *sums, joint_weight, unseen_joints(plan.skeleton))


def _save(
    folder: Path, plan: Plan, sums: Sums, scale: Statistics, learners: Mapping[str, LimitLearner]
) -> None:
    """Save the moments of the training rows, the statistics, and the speeds of the training clips.

    Arrays of the moments: weight (2,) of X and of Y; x (2, X) and y (2, Y), first the mean,
    then the sum of squared deviations from it.
    """
    x, y = ((one.mean, one.squares) for one in sums)
    save_npz(folder / MOMENTS, weight=np.array([one.weight for one in sums]), x=np.array(x), y=np.array(y))
    save_npz(folder / SCALE, **vars(scale))
    for channel, learner in learners.items():
        cycles = {
            f"{number}.{key}": values
            for number, entry in enumerate(plan.clips)
            for key, values in learner.to_arrays(entry["clip"]).items()
        }
        save_npz(folder / f"pace-{channel}.npz", **cycles)


@dataclass(frozen=True)
class Shard:
    """A shard: its folder, its plan, and for each split its chunks."""

    folder: Path
    plan: Plan
    chunks: Mapping[str, list[Chunk]]

    @classmethod
    def load(cls, folder: Path) -> Shard | None:
        """Read the shard in `folder`; None if it has no clips. Raises InputError if it is incomplete."""
        values = read_json(folder / INDEX)
        try:
            if values["plan"] is None:
                return None
            chunks = {split: [Chunk(**chunk) for chunk in values["chunks"][split]] for split in SPLITS}
            return cls(folder, Plan.from_dict(values["plan"]), chunks)
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(folder / INDEX, f"not a shard of a database ({error})", fix=HINT) from error

    def sums(self) -> Sums:
        """The moments of the shard's training rows."""
        data = load_npz(self.folder / MOMENTS)
        x, y = (Moments(float(w), *data[name]) for w, name in zip(data["weight"], "xy", strict=True))
        return x, y

    def scale(self) -> Statistics:
        """The statistics by which the shard's rows are standardised."""
        return Statistics(**load_npz(self.folder / SCALE))

    def add_speeds(self, learners: Mapping[str, LimitLearner]) -> None:
        """Add the speeds of the shard's training clips to the learners of the channels."""
        for channel, learner in learners.items():
            data = load_npz(self.folder / f"pace-{channel}.npz")
            cycles: dict[int, dict[str, np.ndarray]] = {}
            for key, values in data.items():
                number, _, name = key.partition(".")
                cycles.setdefault(int(number), {})[name] = values
            for place, arrays in sorted(cycles.items()):
                learner.add_arrays(self.plan.clips[place]["clip"], arrays)
