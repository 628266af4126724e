"""A shard: the shuffled rows of some clips of a database, in files of a few MB, the chunks.

The job that makes a shard reads only the shard's clips. The rows are standardised by the shard's own means
and standard deviations, so that 16-bit numbers store them well. The reader converts them to the statistics of
the whole database (`hobble.database.scale`). A shard numbers its own clips from 0. So a change of another
shard does not change any of its bytes.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from hobble.channels.speed_limits import LimitLearner
from hobble.core.errors import InputError
from hobble.core.files import failed_write_error, load_npz, read_json, save_npz, write_json
from hobble.database.chunks import HINT, Chunk
from hobble.database.learn_limits import add_rows, make_limit_learners
from hobble.database.manifest import SPLITS
from hobble.database.plan import Plan, RowSource, make_plan
from hobble.database.precision import STORED
from hobble.database.scatter import make_buckets, scatter
from hobble.database.statistics import Moments, Statistics, clip_moments, statistics_of_moments, unseen_joints
from hobble.database.write_in_order import write_chunks

# Bytes of a chunk. A chunk is read in one go, so it is large enough for slow disks and small for any memory.
CHUNK_BYTES = 4 << 20
INDEX, MOMENTS, SCALE = "shard.json", "moments.npz", "scale.npz"  # names of a shard's files
MomentsXY = tuple[Moments, Moments]  # moments of the columns of X, and of the columns of Y


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

    `clips` may be empty, and clips may have no rows. Raises InputError if the rows of the clips differ in
    columns or joints, HobbleError if the disk is full.
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
        no_rows = Moments.of_no_rows(plan.layout.x_size), Moments.of_no_rows(plan.layout.y_size)
        moments: dict[str, MomentsXY] = dict.fromkeys(SPLITS, no_rows)
        learners = make_limit_learners(plan.layout, plan.skeleton)
        for entry, rows, used in scatter(buckets, clips, plan, seed):
            moments[entry["split"]] = add_moments(moments[entry["split"]], clip_moments(used, plan.layout))
            if entry["split"] == "train":
                # Also rows left out of training, because a speed is the mean over all rows of a gait cycle.
                add_rows(learners, rows, (sources or {}).get(entry["clip"]))
        # The training rows define the statistics. A shard without training rows uses its held-out rows.
        of_rows = moments["train"] if moments["train"][0].weight else moments["held_out"]
        statistics = row_statistics(plan, of_rows, joint_weight)
        chunks = {
            split: list(write_chunks(folder, split, buckets[split], plan, statistics, dtype))
            for split in SPLITS
        }
        for split in SPLITS:
            buckets[split].folder.rmdir()
        _save(folder, plan, moments["train"], statistics, learners)
        chunk_entries = {split: [asdict(chunk) for chunk in chunks[split]] for split in SPLITS}
        write_json(folder / INDEX, {"plan": plan.to_dict(), "chunks": chunk_entries})
    except OSError as error:
        raise failed_write_error(error, folder) from error


def add_moments(one: MomentsXY, other: MomentsXY) -> MomentsXY:
    """The moments of two sets of rows together."""
    return one[0] + other[0], one[1] + other[1]


def row_statistics(plan: Plan, moments: MomentsXY, joint_weight: float) -> Statistics:
    """The statistics by which rows with these moments are standardised.

    joint_weight: weight of the joints in the network's input.
    """
    return statistics_of_moments(plan.layout, *moments, joint_weight, unseen_joints(plan.skeleton))


def _save(
    folder: Path,
    plan: Plan,
    moments: MomentsXY,
    statistics: Statistics,
    learners: Mapping[str, LimitLearner],
) -> None:
    """Save the moments of the training rows, the shard's statistics, and the speeds of the training clips.

    The file of moments has the arrays weight (2,), of X and of Y, and x (2, X) and y (2, Y), with the mean in
    the first row and the sum of squared differences from the mean in the second. learners: by channel.
    """
    x, y = ((block.mean, block.squares) for block in moments)
    weight = np.array([block.weight for block in moments])
    save_npz(folder / MOMENTS, weight=weight, x=np.array(x), y=np.array(y))
    save_npz(folder / SCALE, **vars(statistics))
    for channel, learner in learners.items():
        cycles = {
            f"{number}.{key}": values
            for number, entry in enumerate(plan.clips)
            for key, values in learner.to_arrays(entry["clip"]).items()
        }
        save_npz(folder / f"pace-{channel}.npz", **cycles)


@dataclass(frozen=True)
class Shard:
    """A finished shard. folder: its folder. plan: what it contains. chunks: split -> its chunks."""

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

    def moments(self) -> MomentsXY:
        """The moments of the shard's training rows."""
        data = load_npz(self.folder / MOMENTS)
        x, y = (Moments(float(w), *data[name]) for w, name in zip(data["weight"], "xy", strict=True))
        return x, y

    def statistics(self) -> Statistics:
        """The statistics by which the shard's rows are standardised."""
        return Statistics(**load_npz(self.folder / SCALE))

    def add_speeds(self, learners: Mapping[str, LimitLearner]) -> None:
        """Add the speeds of the shard's training clips to the learners. learners: channel -> its learner."""
        for channel, learner in learners.items():
            data = load_npz(self.folder / f"pace-{channel}.npz")
            cycles: dict[int, dict[str, np.ndarray]] = {}  # index of a clip -> name of an array -> values
            for key, values in data.items():
                number, _, name = key.partition(".")
                cycles.setdefault(int(number), {})[name] = values
            for clip_index, arrays in sorted(cycles.items()):
                learner.add_arrays(self.plan.clips[clip_index]["clip"], arrays)
