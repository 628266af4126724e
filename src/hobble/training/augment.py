"""Changes the batches of a training: other paces, other poses, and errors of the network itself."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from hobble.core.quat import Array
from hobble.database.chunks import to_floats
from hobble.database.reader import ChunkWindow, Database, empty_buffers
from hobble.rows.layout import GAITS, blocks_without_terrain, lower_joints
from hobble.runtime.rule import joint_place

# The number of a row is the fractional part of place * STEP_OF_PLACE + batch * STEP_OF_BATCH, with the row's
# place in the batch and the number of the batch. As the steps are irrational, these fractional parts are
# spread evenly over 0..1.
STEP_OF_PLACE, STEP_OF_BATCH = (math.sqrt(5) - 1) / 2, math.sqrt(2) - 1


class EvenSpread:
    """Gives each row of a batch a number from 0 to 1. The numbers are spread evenly over rows and batches.

    A number depends only on the row's place in the whole batch and on how many batches came before.

    batch: largest number of this process's rows in a batch. first: the place of its first row in the whole
    batch.
    """

    def __init__(self, batch: int, device: torch.device, first: int = 0) -> None:
        places = first + torch.arange(batch, device=device).double()
        self.place_terms = torch.remainder(places * STEP_OF_PLACE, 1.0)

    def numbers(self, rows: int, batches: int) -> Tensor:
        """(rows,) float64 from 0 to 1, for the first `rows` rows of this process.

        batches: number of batches before this one.
        """
        return torch.remainder(self.place_terms[:rows] + batches * STEP_OF_BATCH, 1.0)


# Plays rows at other paces along smooth paths, so that neither speed nor path shows who walks.


RISE = 0.5  # largest change of the pace from the middle of the window to its end, as a share of the pace
# Each row gets three numbers: for the pace, for its change, and for how smooth the path becomes. Each number
# is the fractional part of place * step of place + batch * step of batch, with the row's place in the batch
# and the number of the batch. As the steps are irrational, the numbers are spread evenly over 0..1.
STEPS_OF_PLACE = (math.sqrt(3) - 1, math.sqrt(7) - 2, math.sqrt(11) - 3)
STEPS_OF_BATCH = (math.sqrt(13) - 3, math.sqrt(17) - 4, math.sqrt(19) - 4)


class OtherPaces:
    """Plays each row's motion slower or faster, and moves its path towards a smooth one. X and Y both change.

    If the clips have few people, each at one speed, the speed in the input shows who walks. So does the sway
    of the path in each step. At run time the character has another speed and a straighter path, so the
    network takes it for somebody else, and the walk changes with the speed. With these rows anybody walks at
    any speed.

    The time t in the window, which has T frames on each side, becomes r t (1 + a t / T). Here log(r) is
    between -log(factor) and log(factor), and 2 a is between -RISE and RISE. Trajectory, gait and ground are
    interpolated at the new times. Past the ends of the window, positions continue straight, and directions,
    gait and ground keep their last values. Velocities, turn and change of phase are multiplied by r. Then the
    path moves towards the nearest parabola, by 0 to 1 times the way. log(r), a and this factor are spread
    evenly over the places of a batch and over batches.

    factor: largest r; 1 changes nothing, not even the path. batch: largest number of this process's rows in a
    batch. first: the place of its first row in the whole batch.
    """

    def __init__(
        self, database: Database, factor: float, batch: int, device: torch.device, first: int = 0
    ) -> None:
        layout, statistics = database.layout, database.statistics
        self.layout, self.log_factor = layout, math.log(factor)
        self.x_std, self.x_mean, self.y_std, self.y_mean = (
            torch.from_numpy(part).to(device, torch.float32)
            for part in (statistics.x_std, statistics.x_mean, statistics.y_std, statistics.y_mean)
        )
        blocks = [layout.x_channel(name) for name, _ in layout.channels]
        self.channel_columns = [torch.arange(block.start, block.stop, device=device) for block in blocks]
        time = np.arange(layout.samples) / (layout.samples // 2) - 1.0  # -1 at the first sample, 0 now
        # Matrices that replace the samples of a path by the nearest parabola. The one for positions needs no
        # constant term, because they are 0 in the present frame.
        self.smooth_position, self.smooth_direction = (
            torch.from_numpy(_projection(np.stack([time**k for k in powers], axis=1))).to(
                device, torch.float32
            )
            for powers in ((1, 2), (0, 1, 2))
        )
        places = first + torch.arange(batch, device=device).double()
        self.place_terms = torch.stack([places * step for step in STEPS_OF_PLACE])
        self.batch_steps = torch.tensor(STEPS_OF_BATCH, device=device, dtype=torch.float64)[:, None]
        self.batches = 0

    def begin_section(self) -> None:
        """Count batches from 0 again, so that a section does not depend on the previous one."""
        self.batches = 0

    def play(self, x: Tensor, y: Tensor) -> None:
        """Change standardised inputs x (B, X) and outputs y (B, Y) in place."""
        if not self.log_factor or not len(x):
            return
        even = torch.remainder(self.place_terms[:, : len(x)] + self.batches * self.batch_steps, 1.0)
        self.batches += 1
        even_pace, even_rise, smoothness = even.to(x.dtype)[:, :, None]
        # r and a of the class's docstring.
        pace, rise = torch.exp((2 * even_pace - 1) * self.log_factor), (2 * even_rise - 1) * RISE / 2
        channels = [x[:, columns] for columns in self.channel_columns]
        # Channels get their old values back below. A channel that never varies is standardised by so large a
        # deviation that multiplying and dividing by it loses the value.
        raw_x, raw_y = x * self.x_std + self.x_mean, y * self.y_std + self.y_mean
        self._play_window(raw_x, raw_y, pace, rise)
        self._play_frame(raw_x, raw_y, pace)
        self._smooth(raw_x, smoothness)
        x.copy_((raw_x - self.x_mean) / self.x_std)
        y.copy_((raw_y - self.y_mean) / self.y_std)
        for columns, values in zip(self.channel_columns, channels, strict=True):
            x[:, columns] = values

    def _play_window(self, x: Tensor, y: Tensor, pace: Tensor, rise: Tensor) -> None:
        """Replace trajectory, gait and ground by those at the new times. pace, rise: (B, 1) r and a.

        Heights stay relative to the mean ground height under the path.
        """
        layout, n = self.layout, self.layout.samples
        blocks = [(layout.x_position, False), (layout.x_direction, True), (layout.x_gait, True)]
        for block, keep_last in [*blocks, (layout.x_terrain, True)]:
            x[:, block] = _interpolate(x[:, block], n, layout.future, pace, rise, keep_last)
        for block, keep_last in ((layout.y_position, False), (layout.y_direction, True)):
            y[:, block] = _interpolate(y[:, block], layout.future, layout.future, pace, rise, keep_last)
        ground = x[:, layout.x_terrain]
        mean = ground[:, n : 2 * n].mean(dim=1, keepdim=True)  # of the samples on the path, between the sides
        ground -= mean
        x[:, layout.x_joint_position][:, 1::3] -= mean
        y[:, layout.y_joint_position][:, 1::3] -= mean

    def _play_frame(self, x: Tensor, y: Tensor, pace: Tensor) -> None:
        """Multiply what happens in a frame by the pace.

        The pose in x is that of the previous frame. It moves so that the joints' way from it to the pose in y
        is multiplied, too.
        """
        layout = self.layout
        before, now = x[:, layout.x_joint_position], y[:, layout.y_joint_position]
        before += (1 - pace) * (now - before)
        x[:, layout.x_joint_velocity] *= pace
        for block in (layout.y_root_velocity, layout.y_turn, layout.y_phase_change, layout.y_joint_velocity):
            y[:, block] *= pace

    def _smooth(self, x: Tensor, share: Tensor) -> None:
        """Move the path in x by the share (B, 1) of the way to the nearest parabola."""
        layout = self.layout
        for block, nearest in (
            (layout.x_position, self.smooth_position),
            (layout.x_direction, self.smooth_direction),
        ):
            path = x[:, block].unflatten(1, (2, layout.samples))
            x[:, block] = torch.lerp(path, path @ nearest.T, share[:, :, None]).flatten(1)


def _projection(powers: Array) -> Array:
    """(n, n) the matrix that projects n values onto the columns of `powers` (n, k), by least squares.

    The result is the nearest polynomial if the columns are powers of the time.
    """
    return powers @ np.linalg.pinv(powers)


def _interpolate(
    values: Tensor, samples: int, half: int, pace: Tensor, rise: Tensor, keep_last: bool
) -> Tensor:
    """Interpolate values (B, columns * samples) at the new times. pace, rise: (B, 1) r and a.

    samples: number of samples of `values`, which cover the whole window or its second half. half: samples in
    half of the window. keep_last: whether values stay constant past the ends of the window; else they
    continue straight.
    """
    table, now = values.unflatten(1, (-1, samples)), samples - half  # now: index of the present frame
    time = torch.arange(samples, device=values.device) - now
    place = now + pace * time * (1 + rise * time / half)
    if keep_last:
        place = place.clamp(0, samples - 1)
    below = place.floor().clamp(0, samples - 2)
    index = below.long()[:, None].expand(-1, table.shape[1], -1)
    share = (place - below)[:, None].to(values.dtype)
    return torch.lerp(table.gather(2, index), table.gather(2, index + 1), share).flatten(1)


# Moves input poses towards poses with other channel values, so that a network has to use its channels.


REMEMBERED_ROWS = 32  # number of earlier rows that each place in a batch remembers
NEAR = 1 / 16  # poses are mixed only if their phases differ by less than this, in cycles
SAME_GAIT = 0.5  # poses are mixed only if the share of each gait differs by less than this
BEYOND = 0.5  # a pose may also move away from the other pose, by up to this share of the distance
OTHER_VALUE = 1e-3  # standardised channel values that differ by more than this count as different


class OtherPoses:
    """Moves the pose in some rows of X towards the pose of a row with other channel values. Y is unchanged.

    If a channel is constant in a clip, such as a mood, all poses of the clip show the channel's value, too.
    Then a network can ignore the channel and continue the walk that it sees, and a character keeps the walk
    that its pose has drifted to. For example, a network was trained without moved poses on 24 people with one
    of three diagnoses or none. Its character walked like another group than the requested one. With moved
    poses, only the channels tell which walk Y belongs to.

    Each place in a batch remembers only its own earlier rows, so several processes give the same rows as one.
    Of the remembered rows with the same gait and other channel values, the one with the nearest phase is
    chosen. The pose moves by -BEYOND to 1 times the way to the pose of the chosen row. These factors are
    spread evenly over places and batches. With a negative factor, the pose becomes more extreme than any
    captured one, and the network learns the way back. Without such poses a character that leaned forward
    leaned more and more.

    share: share of the rows that are moved; 0 changes nothing. batch: largest number of this process's rows
    in a batch. first: the place of its first row in the whole batch.
    """

    def __init__(
        self, database: Database, share: float, batch: int, device: torch.device, first: int = 0
    ) -> None:
        layout, middle = database.layout, database.layout.samples // 2
        self.share = share if batch and layout.channels else 0.0
        blocks = (layout.x_joint_position, layout.x_joint_velocity)
        # Columns of X: those of the pose, the share of each gait in the present frame, and the channels.
        self.pose_columns = torch.cat([torch.arange(b.start, b.stop) for b in blocks]).to(device)
        start, samples = layout.x_gait.start, layout.samples
        present = [start + gait * samples + middle for gait in range(len(GAITS))]
        self.gait_columns = torch.tensor(present, device=device)
        std = torch.from_numpy(database.statistics.x_std).to(device, torch.float32)
        self.gait_std = std[self.gait_columns]
        columns = [torch.arange(0)] + [
            torch.arange(layout.x_size)[layout.x_channel(name)] for name, _ in layout.channels
        ]
        self.channel_columns = torch.cat(columns).to(device)
        self.places = torch.arange(batch, device=device)
        self.spread = EvenSpread(batch, device, first)
        rows = batch if self.share else 0
        # The remembered rows of each place. A new row replaces the oldest one.
        self.poses, self.gaits, self.channels = (
            torch.zeros(rows, REMEMBERED_ROWS, len(columns), device=device)
            for columns in (self.pose_columns, self.gait_columns, self.channel_columns)
        )
        self.phases = torch.full((rows, REMEMBERED_ROWS), torch.nan, device=device)  # nan: no row yet
        self.batches = 0

    def begin_section(self) -> None:
        """Forget all rows, so that a section does not depend on the previous one."""
        self.phases.fill_(torch.nan)
        self.batches = 0

    def mix(self, x: Tensor, p: Tensor) -> None:
        """Move the poses of standardised inputs x (B, X) in place. p: (B,) phases, 0 to 1."""
        if not self.share or not len(x):
            return
        rows, slot = len(x), self.batches % REMEMBERED_ROWS
        pose, values = x[:, self.pose_columns], x[:, self.channel_columns]
        gait = x[:, self.gait_columns] * self.gait_std  # not standardised, apart from a constant
        same_gait = (gait[:, None] - self.gaits[:rows]).abs().amax(dim=2) < SAME_GAIT
        other_value = (values[:, None] - self.channels[:rows]).abs().amax(dim=2) > OTHER_VALUE
        # Difference in phase, at most half a cycle.
        apart = (torch.remainder(p[:, None] - self.phases[:rows] + 0.5, 1.0) - 0.5).abs()
        apart = torch.where(same_gait & other_value & (apart < NEAR), apart, torch.inf)
        nearest, chosen = apart.min(dim=1)
        factor = torch.where(nearest < NEAR, self._factors(rows).to(x.dtype), 0.0)
        other_pose = self.poses[self.places[:rows], chosen]
        x[:, self.pose_columns] = torch.lerp(pose, other_pose, factor[:, None])
        remembered = (self.poses, self.gaits, self.channels, self.phases)
        for table, row in zip(remembered, (pose, gait, values, p), strict=True):
            table[:rows, slot] = row
        self.batches += 1

    def _factors(self, rows: int) -> Tensor:
        """(rows,) how far each pose moves: in `share` of the rows spread evenly from -BEYOND to 1, else 0."""
        even = self.spread.numbers(rows, self.batches)
        factor = 1 - (1 - even) / self.share  # above 0 in `share` of the rows, and there spread from 0 to 1
        return torch.where(factor > 0, factor * (1 + BEYOND) - BEYOND, 0.0)


# Moves input poses between a clip and its hurt versions, so that a network learns what an injury changes.
#
# A hurt version is a copy of a healthy clip in which Hobble has made some links injured. A link is a pair of
# neighbouring joints, such as hip and knee.


SPLIT = "train"
# Memory for the poses of the training rows. If they need more, only every second (third, ...) row is used.
TABLE_BYTES = 256 << 20
CANDIDATES = 8  # the pose comes from one of this many rows with the nearest phases: the most similar path
NEAR_PHASE = 1 / 32  # largest difference in phase between two poses that are mixed, in cycles


class VersionPoses:
    """Moves the pose in rows of X towards the pose of another version of the same clip. Y is unchanged.

    Each link is hurt in few clips. So a network can take the posture of these clips for a sign of the injury,
    and continue the walk that it sees. If a character limps as at severity 10 and the severity then falls to
    5, it goes on limping just as much. With the moved poses, the network sees the poses of each clip both
    with and without the injury, and only the channels tell whether Y is hurt.

    The pose of a hurt row moves along the line to a pose of the healthy clip. The pose of a healthy row moves
    along the line to a pose of a hurt version. This other pose comes from a row with nearly the same phase:
    the one whose path turns most like the path of the moved row. The pose moves by a factor of -1 to 1 times
    the way to the other pose; a negative factor moves it away. The factors are spread evenly. They depend
    only on the row's place in the batch and on the number of the batch, so several processes change the rows
    just as one process would. Rows of clips without hurt versions are not changed.

    The mean of the factors is 0, for this reason: if all poses of X moved towards the other version, Y would
    always be further from that version than X, because Y does not move. The network would learn to step away
    from that version in each frame, so the character would exaggerate its limp at run time.

    share: share of the rows that are moved; 0 changes nothing. batch: largest number of this process's rows
    in a batch. first: the place of its first row in the whole batch.
    """

    def __init__(
        self, database: Database, share: float, batch: int, device: torch.device, first: int = 0
    ) -> None:
        names, sources = database.clips, database.sources
        self.share = share if batch and sources else 0.0
        if not self.share:
            return
        layout = database.layout
        index_of = {name: i for i, name in enumerate(names)}
        hurt = np.array([name in sources for name in names])
        # Each clip's family: the index of its healthy original; -1 for clips without hurt versions.
        family = np.array([index_of.get(sources.get(name, name), -1) for name in names])
        family[~np.isin(family, family[hurt])] = -1
        # The healthy clip of a family has one key, and its hurt versions share another. `own_key` is the key
        # of each clip, and `other_key` is the key of the clips whose poses it gets. Rows are sorted by the
        # key of their clip plus their phase. Keys are 2 apart, so that rows of different keys are never near.
        # Clips without hurt versions have a negative key.
        self.own_key = np.where(family < 0, -2.0, 2.0 * (family + len(names) * hurt))
        self.other_key = np.where(family < 0, -2.0, 2.0 * (family + len(names) * ~hurt))
        self.pose_blocks = (layout.x_joint_position, layout.x_joint_velocity)
        self.direction_block = layout.x_direction
        key, poses, directions = _pose_table(database, self.own_key)
        self.key = torch.from_numpy(key).to(device)
        self.poses, self.directions = (torch.from_numpy(array).to(device) for array in (poses, directions))
        self.spread = EvenSpread(batch, device, first)
        # The places of the candidates, counted from the place of the sought key.
        self.offsets = torch.arange(CANDIDATES, device=device) - CANDIDATES // 2
        self.batches = 0  # number of batches since `begin_section`

    def begin_section(self) -> None:
        """Count batches from 0 again, so that a section does not depend on the previous one."""
        self.batches = 0

    def mix(self, x: Tensor, p: Tensor, clip: np.ndarray) -> None:
        """Move the poses of standardised inputs x (B, X) in place.

        p: (B,) phases, 0 to 1. clip: (B,) indices into the database's clips.
        """
        if not self.share or not len(x) or not len(self.key):
            return
        factors = self._factors(len(x))
        self.batches += 1
        moved = torch.nonzero(factors).flatten()
        sought = torch.from_numpy(self.other_key[clip]).to(x.device)[moved] + p[moved].double()
        candidates = torch.searchsorted(self.key, sought)[:, None] + self.offsets
        candidates = candidates.clamp(0, len(self.key) - 1)
        is_near = ((self.key[candidates] - sought[:, None]).abs() < NEAR_PHASE) & (sought >= 0)[:, None]
        path_difference = torch.linalg.vector_norm(
            self.directions[candidates] - x[moved, self.direction_block][:, None], dim=2
        )
        smallest, chosen = torch.where(is_near, path_difference, torch.inf).min(dim=1)
        factor = torch.where(smallest < torch.inf, factors[moved], 0.0).to(x.dtype)
        other_pose = self.poses[candidates.gather(1, chosen[:, None])[:, 0]]
        for block, other_block in zip(self.pose_blocks, other_pose.chunk(2, dim=1), strict=True):
            x[moved, block] = torch.lerp(x[moved, block], other_block, factor[:, None])

    def _factors(self, rows: int) -> Tensor:
        """(rows,) the factor of each row: spread evenly from -1 to 1 in `share` of the rows, else 0."""
        even = self.spread.numbers(rows, self.batches)
        return torch.where(even < self.share, 2 * even / self.share - 1, 0.0)


def _pose_table(database: Database, clip_keys: Array) -> tuple[Array, Array, Array]:
    """Keys (n,), poses (n, D) and path directions (n, E) of the training rows of clips with hurt versions.

    These are the clips of hurt versions and their healthy originals. Poses and directions are standardised.
    clip_keys: (clips,) key of each clip; clips with a negative key are left out. The key of a row is the key
    of its clip plus the phase. The rows are sorted by key.
    """
    manifest = database.manifest
    blocks, buffers = blocks_without_terrain(database.layout), empty_buffers(manifest, SPLIT, 1)
    pose_columns, direction_columns = (
        np.r_[tuple(blocks[name] for name in names)]
        for names in (("joint_position", "joint_velocity"), ("direction",))
    )
    table_bytes = 4 * (len(pose_columns) + len(direction_columns)) * manifest.row_count(SPLIT)  # float32
    row_step = max(1, math.ceil(table_bytes / TABLE_BYTES))
    parts = [
        (  # arrays without rows, so that there is something to concatenate
            np.empty(0),
            np.empty((0, len(pose_columns)), np.float32),
            np.empty((0, len(direction_columns)), np.float32),
        ),
        *(
            _chunk_table(
                database.load(SPLIT, [number], buffers),
                clip_keys,
                pose_columns,
                direction_columns,
                database,
                row_step,
            )
            for number in range(len(manifest.chunks[SPLIT]))
        ),
    ]
    key, poses, directions = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.argsort(key, kind="stable")
    return key[order], poses[order], directions[order]


def _chunk_table(
    window: ChunkWindow,
    clip_keys: Array,
    pose_columns: np.ndarray,
    direction_columns: np.ndarray,
    database: Database,
    row_step: int,
) -> tuple[Array, Array, Array]:
    """The arrays of `_pose_table` for one chunk, not sorted, with every `row_step`-th row of the clips.

    window: the rows of the chunk. pose_columns, direction_columns: columns of X without terrain. Joint
    heights are measured from the mean ground height of the row's first terrain fit.
    """
    key = clip_keys[window.clip] + window.phase
    chosen = np.flatnonzero(key >= 0)[::row_step]
    x = to_floats(window.x[chosen]).astype(np.float32)
    lift = to_floats(window.fits[window.first_fit[chosen]]).astype(np.float32)[:, -1:]
    lower_joints(
        x, blocks_without_terrain(database.layout)["joint_position"], lift, _without_terrain_std(database)
    )
    return key[chosen], x[:, pose_columns], x[:, direction_columns]


def _without_terrain_std(database: Database) -> Array:
    """(columns,) standard deviations of X without its terrain columns."""
    return np.delete(database.statistics.x_std, database.layout.x_terrain)


# Roll-outs in training: the network's own errors are added to its input poses, as at run time.


class RollOut:
    """Adds to the pose in X the errors that the network would have accumulated; Y is unchanged.

    At run time a joint's next position is the mean of two: the predicted position, and the old position plus
    the predicted velocity. Let d be the present error of the joint's position, and p and v the errors of the
    predicted position and velocity. In the next frame the joint's position is off by (d + v + p) / 2, and its
    velocity by v. (The turn of the root between the frames, a few hundredths of a radian, is ignored.)

    Each place in a batch carries its errors to the same place in the next batch. There the row is usually of
    another clip, because rows are shuffled. The errors still have a realistic size and pattern over the
    joints. (If each row got the errors of its own past, the network would learn this past by heart, and the
    error on held-out clips would grow.)

    frames: length of a roll-out. Its first pose is the captured one, so 1 changes nothing. batch: largest
    number of this process's rows in a batch. first: the place of its first row in the whole batch.
    """

    def __init__(
        self, database: Database, frames: int, batch: int, device: torch.device, first: int = 0
    ) -> None:
        layout, s = database.layout, database.statistics
        self.frames, self.first = frames, first
        self.x_position, self.x_velocity = layout.x_joint_position, layout.x_joint_velocity
        self.y_position, self.y_velocity = layout.y_joint_position, layout.y_joint_velocity
        # Factors that turn errors in standardised Y into errors in standardised X. For example,
        # `position_of_velocity` is for the error that a velocity in Y causes in a position in X.
        self.position_of_position, self.position_of_velocity, self.velocity_of_velocity = (
            torch.from_numpy(s.y_std[y_block] / s.x_std[x_block]).to(device, torch.float32)
            for x_block, y_block in (
                (self.x_position, self.y_position),
                (self.x_position, self.y_velocity),
                (self.x_velocity, self.y_velocity),
            )
        )
        # The present errors in standardised X, for each place in the batch.
        self.position, self.velocity = (
            torch.zeros(batch, 3 * layout.joints, device=device) for _ in range(2)
        )
        self.batches = 0

    def begin_section(self) -> None:
        """Set all errors to 0, so that a section does not depend on the previous one."""
        self.position.zero_()
        self.velocity.zero_()
        self.batches = 0

    def add(self, x: Tensor) -> None:
        """Add the errors to standardised inputs x (B, X) in place."""
        if self.frames > 1:
            x[:, self.x_position] += self.position[: len(x)]
            x[:, self.x_velocity] += self.velocity[: len(x)]

    def remember(self, error: Tensor) -> None:
        """Advance the errors by a frame. error: (B, Y) prediction minus Y of this batch, standardised."""
        if self.frames == 1:
            return
        rows = len(error)
        position, velocity = error[:, self.y_position], error[:, self.y_velocity]
        added = position * self.position_of_position + velocity * self.position_of_velocity
        self.position[:rows] = joint_place(self.position[:rows], added)  # (d + p + v) / 2
        torch.mul(velocity, self.velocity_of_velocity, out=self.velocity[:rows])
        self.batches += 1
        # After each batch, the roll-outs of every `frames`-th place end, so that not all end at once.
        ended = slice((self.batches - self.first) % self.frames, None, self.frames)
        self.position[ended] = 0
        self.velocity[ended] = 0
