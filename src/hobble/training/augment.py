"""Changes the batches of a training: other paces, other poses, and errors of the network itself.

Each way to change them is an `Augmentation`. `augmentations` makes those that a training asks for.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor

from hobble.core.quat import Array
from hobble.database.reader import Database
from hobble.rows.layout import GAITS, RowLayout, blocks_without_terrain, lower_joints, pose_blocks
from hobble.runtime.trajectory import joint_place
from hobble.training import Training
from hobble.training.batches import TRAIN, SampleBatch

# A number from 0 to 1 for each row is the fractional part of place * step of place + batch * step of batch,
# with the row's place in the batch and the number of the batch. As the steps are irrational, these numbers
# are spread evenly over rows and batches.
STEP_OF_PLACE, STEP_OF_BATCH = (math.sqrt(5) - 1) / 2, math.sqrt(2) - 1


class Augmentation(ABC):
    """A change to every batch of a training.

    It depends only on the rows, their places in the whole batch, and the batches before in the same section.
    So several processes change the rows just as one process would.

    places: the places in the whole batch that this process's rows fill. batches: number of batches so far in
    the section.
    """

    def __init__(self, places: range, device: torch.device) -> None:
        self.places, self.batches = places, 0
        self._places = places.start + torch.arange(len(places), device=device).double()

    def begin_section(self) -> None:
        """Forget all batches, so that a section does not depend on the previous one."""
        self.batches = 0

    @abstractmethod
    def change(self, batch: SampleBatch) -> None:
        """Change a batch of standardised rows, which has at least one, in place."""

    def after(self, error: Tensor) -> None:
        """Call this after each batch. error: (B, Y) prediction minus Y, standardised."""
        self.batches += 1

    def spread(self, rows: int, place: float = STEP_OF_PLACE, batch: float = STEP_OF_BATCH) -> Tensor:
        """(rows,) float64 numbers from 0 to 1, spread evenly over rows and batches by these steps."""
        return torch.remainder(torch.remainder(self._places[:rows] * place, 1.0) + self.batches * batch, 1.0)


def augmentations(
    database: Database, training: Training, places: range, device: torch.device
) -> list[Augmentation]:
    """The augmentations that the section `training` asks for, in the order in which they change a batch."""
    asked: list[tuple[Any, float, bool]] = [
        (OtherPaces, training.other_paces, training.other_paces > 1),
        (OtherPoses, training.other_poses, bool(training.other_poses and database.layout.channels)),
        (VersionPoses, training.version_poses, bool(training.version_poses and database.sources)),
        (RollOut, training.rollout, training.rollout > 1),
    ]
    return [kind(database, amount, places, device) for kind, amount, is_asked in asked if is_asked]


def x_pose(blocks: Mapping[str, slice]) -> np.ndarray:
    """The columns of the pose in X. blocks: as for `pose_blocks`."""
    return np.concatenate([np.r_[block] for block in pose_blocks(blocks)])


def channel_columns(layout: RowLayout, device: torch.device) -> Tensor:
    """(n,) the columns of all channels in X."""
    every = range(layout.x_size)
    columns = [column for name, _ in layout.channels for column in every[layout.x_channel(name)]]
    return torch.tensor(columns, dtype=torch.long, device=device)


# Plays rows at other paces along smooth paths, so that neither speed nor path shows who walks.


RISE = 0.5  # largest change of the pace from the middle of the window to its end, as a share of the pace
# The steps of place and of batch of a row's three numbers: for the pace, for its change, and for how smooth
# the path becomes.
STEPS = (
    (math.sqrt(3) - 1, math.sqrt(13) - 3),
    (math.sqrt(7) - 2, math.sqrt(17) - 4),
    (math.sqrt(11) - 3, math.sqrt(19) - 4),
)


class OtherPaces(Augmentation):
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

    factor: largest r, above 1.
    """

    def __init__(self, database: Database, factor: float, places: range, device: torch.device) -> None:
        super().__init__(places, device)
        layout, statistics = database.layout, database.statistics
        self.layout, self.log_factor = layout, math.log(factor)
        self.x_std, self.x_mean, self.y_std, self.y_mean = (
            torch.from_numpy(part).to(device, torch.float32)
            for part in (statistics.x_std, statistics.x_mean, statistics.y_std, statistics.y_mean)
        )
        self.channels = channel_columns(layout, device)
        time = np.arange(layout.samples) / (layout.samples // 2) - 1.0  # -1 at the first sample, 0 now
        # Matrices that replace the samples of a path by the nearest parabola. The one for positions needs no
        # constant term, because they are 0 in the present frame.
        powers = np.stack([time**0, time, time**2], axis=1)
        self.smooth_position, self.smooth_direction = (
            torch.from_numpy(columns @ np.linalg.pinv(columns)).to(device, torch.float32)  # by least squares
            for columns in (powers[:, 1:], powers)
        )

    def change(self, batch: SampleBatch) -> None:
        """As in `Augmentation`."""
        x, y = batch.x, batch.y
        even_pace, even_rise, smoothness = (
            self.spread(len(x), *steps).to(x.dtype)[:, None] for steps in STEPS
        )
        # r and a of the class's docstring.
        pace, rise = torch.exp((2 * even_pace - 1) * self.log_factor), (2 * even_rise - 1) * RISE / 2
        # Channels get their old values back below. A channel that never varies is standardised by so large a
        # deviation that multiplying and dividing by it loses the value.
        channels = x[:, self.channels]
        raw_x, raw_y = x * self.x_std + self.x_mean, y * self.y_std + self.y_mean
        self._play_window(raw_x, raw_y, pace, rise)
        self._play_frame(raw_x, raw_y, pace)
        self._smooth(raw_x, smoothness)
        x.copy_((raw_x - self.x_mean) / self.x_std)
        y.copy_((raw_y - self.y_mean) / self.y_std)
        x[:, self.channels] = channels

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
        moved = [(layout.x_joint_position, layout.y_joint_position)]
        moved += [(layout.x_joint_rotation, layout.y_joint_rotation)] if layout.local_phases else []
        for of_x, of_y in moved:
            x[:, of_x] += (1 - pace) * (y[:, of_y] - x[:, of_x])
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


class OtherPoses(Augmentation):
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

    share: share of the rows that are moved.
    """

    def __init__(self, database: Database, share: float, places: range, device: torch.device) -> None:
        super().__init__(places, device)
        layout = database.layout
        self.share, self.pose = share, x_pose(layout.blocks("x"))
        # Columns of X: the share of each gait in the present frame, and the channels.
        first = layout.x_gait.start + layout.samples // 2
        self.gait_columns = first + layout.samples * torch.arange(len(GAITS), device=device)
        std = torch.from_numpy(database.statistics.x_std).to(device, torch.float32)
        self.gait_std = std[self.gait_columns]
        self.channel_columns = channel_columns(layout, device)
        # The remembered rows of each place. A new row replaces the oldest one.
        sizes = (len(self.pose), len(GAITS), len(self.channel_columns))
        self.poses, self.gaits, self.channels = (
            torch.zeros(len(places), REMEMBERED_ROWS, size, device=device) for size in sizes
        )
        self.phases = torch.full((len(places), REMEMBERED_ROWS), torch.nan, device=device)  # nan: no row yet

    def begin_section(self) -> None:
        """As in `Augmentation`."""
        super().begin_section()
        self.phases.fill_(torch.nan)

    def change(self, batch: SampleBatch) -> None:
        """As in `Augmentation`."""
        x, p = batch.x, batch.p
        rows, slot = len(x), self.batches % REMEMBERED_ROWS
        pose, values = x[:, self.pose].clone(), x[:, self.channel_columns]
        gait = x[:, self.gait_columns] * self.gait_std  # not standardised, apart from a constant
        same_gait = (gait[:, None] - self.gaits[:rows]).abs().amax(dim=2) < SAME_GAIT
        other_value = (values[:, None] - self.channels[:rows]).abs().amax(dim=2) > OTHER_VALUE
        # Difference in phase, at most half a cycle.
        apart = (torch.remainder(p[:, None] - self.phases[:rows] + 0.5, 1.0) - 0.5).abs()
        apart = torch.where(same_gait & other_value & (apart < NEAR), apart, torch.inf)
        nearest, chosen = apart.min(dim=1)
        factor = torch.where(nearest < NEAR, self._factors(rows).to(x.dtype), 0.0)
        other_pose = self.poses[torch.arange(rows, device=x.device), chosen]
        x[:, self.pose] = torch.lerp(pose, other_pose, factor[:, None])
        remembered = (self.poses, self.gaits, self.channels, self.phases)
        for table, row in zip(remembered, (pose, gait, values, p), strict=True):
            table[:rows, slot] = row

    def _factors(self, rows: int) -> Tensor:
        """(rows,) how far each pose moves: in `share` of the rows spread evenly from -BEYOND to 1, else 0."""
        even = self.spread(rows)
        factor = 1 - (1 - even) / self.share  # above 0 in `share` of the rows, and there spread from 0 to 1
        return torch.where(factor > 0, factor * (1 + BEYOND) - BEYOND, 0.0)


# Moves input poses between a clip and its hurt versions, so that a network learns what an injury changes.
#
# A hurt version is a copy of a healthy clip in which Hobble has made some links injured. A link is a pair of
# neighbouring joints, such as hip and knee.


# Memory for the poses of the training rows. If they need more, only every second (third, ...) row is used.
TABLE_BYTES = 256 << 20
CANDIDATES = 8  # the pose comes from one of this many rows with the nearest phases: the most similar path
NEAR_PHASE = 1 / 32  # largest difference in phase between two poses that are mixed, in cycles
# A healthy row is moved less often than a hurt one, by this factor. The injury is learnt from the hurt rows;
# in the healthy ones moved poses only make the healthy walk less accurate.
HEALTHY_SHARE = 1 / 20


class VersionPoses(Augmentation):
    """Moves the pose in rows of X towards the pose of another version of the same clip. Y is unchanged.

    Each link is hurt in few clips. So a network can take the posture of these clips for a sign of the injury,
    and continue the walk that it sees. If a character limps as at severity 10 and the severity then falls to
    5, it goes on limping just as much. With the moved poses, the network sees the poses of each clip both
    with and without the injury, and only the channels tell whether Y is hurt.

    The pose of a hurt row moves along the line to a pose of the healthy clip. The pose of a healthy row moves
    more rarely (HEALTHY_SHARE), along the line to a pose of a hurt version. This other pose comes from a row
    with nearly the same phase: the one whose path turns most like the path of the moved row. The pose moves
    by a factor of -1 to 1 times the way to the other pose; a negative factor moves it away. The factors are
    spread evenly. Rows of clips without hurt versions are not changed.

    The mean of the factors is 0, for this reason: if all poses of X moved towards the other version, Y would
    always be further from that version than X, because Y does not move. The network would learn to step away
    from that version in each frame, so the character would exaggerate its limp at run time.

    share: share of the hurt rows that are moved.
    """

    def __init__(self, database: Database, share: float, places: range, device: torch.device) -> None:
        super().__init__(places, device)
        names, sources, layout = database.clips, database.sources, database.layout
        index_of = {name: i for i, name in enumerate(names)}
        hurt = np.array([name in sources for name in names])
        self.shares = share * np.where(hurt, 1.0, HEALTHY_SHARE)
        # Each clip's family: the index of its healthy original; -1 for clips without hurt versions.
        family = np.array([index_of.get(sources.get(name, name), -1) for name in names])
        family[~np.isin(family, family[hurt])] = -1
        # The healthy clip of a family has one key, and its hurt versions share another. `own_key` is the key
        # of each clip, and `other_key` is the key of the clips whose poses it gets. Rows are sorted by the
        # key of their clip plus their phase. Keys are 2 apart, so that rows of different keys are never near.
        # Clips without hurt versions have a negative key.
        self.own_key = np.where(family < 0, -2.0, 2.0 * (family + len(names) * hurt))
        self.other_key = np.where(family < 0, -2.0, 2.0 * (family + len(names) * ~hurt))
        self.pose, self.direction = x_pose(layout.blocks("x")), layout.x_direction
        key, poses, directions = _pose_table(database, self.own_key)
        self.key = torch.from_numpy(key).to(device)
        self.poses, self.directions = (torch.from_numpy(array).to(device) for array in (poses, directions))
        # The places of the candidates, counted from the place of the sought key.
        self.offsets = torch.arange(CANDIDATES, device=device) - CANDIDATES // 2

    def change(self, batch: SampleBatch) -> None:
        """As in `Augmentation`."""
        if not len(self.key):
            return
        x, even = batch.x, self.spread(len(batch.x))
        share = torch.from_numpy(self.shares[batch.clip]).to(x.device)
        # In this share of the rows spread evenly from -1 to 1, else 0.
        factors = torch.where(even < share, 2 * even / share - 1, 0.0)
        moved = torch.nonzero(factors).flatten()
        key = torch.from_numpy(self.other_key[batch.clip]).to(x.device)
        sought = key[moved] + batch.p[moved].double()
        candidates = torch.searchsorted(self.key, sought)[:, None] + self.offsets
        candidates = candidates.clamp(0, len(self.key) - 1)
        is_near = ((self.key[candidates] - sought[:, None]).abs() < NEAR_PHASE) & (sought >= 0)[:, None]
        other_way = self.directions[candidates] - x[moved, self.direction][:, None]
        path_difference = torch.linalg.vector_norm(other_way, dim=2)
        smallest, chosen = torch.where(is_near, path_difference, torch.inf).min(dim=1)
        factor = torch.where(smallest < torch.inf, factors[moved], 0.0).to(x.dtype)
        other_pose = self.poses[candidates.gather(1, chosen[:, None])[:, 0]]
        columns = moved[:, None], self.pose
        x[columns] = torch.lerp(x[columns], other_pose, factor[:, None])


def _pose_table(database: Database, clip_keys: Array) -> tuple[Array, Array, Array]:
    """Keys (n,), poses (n, D) and path directions (n, E) of the training rows of clips with hurt versions.

    These are the clips of hurt versions and their healthy originals. Poses and directions are standardised.
    Joint heights are measured from the mean ground height of the row's first terrain fit. clip_keys: (clips,)
    key of each clip; clips with a negative key are left out. The key of a row is the key of its clip plus the
    phase. The rows are sorted by key.
    """
    blocks = blocks_without_terrain(database.layout)
    std = np.delete(database.statistics.x_std, database.layout.x_terrain)
    pose_columns = x_pose(blocks)
    row_bytes = 4 * len(np.r_[pose_columns, blocks["direction"]])  # float32
    row_step = max(1, math.ceil(row_bytes * database.row_count(TRAIN) / TABLE_BYTES))
    parts = []
    for rows in database.each_row(TRAIN):
        key = clip_keys[rows.clip] + rows.p
        chosen = np.flatnonzero(key >= 0)[::row_step]
        x, lift = rows.x[chosen], rows.fits[rows.first_fit[chosen], -1:]
        lower_joints(x, blocks["joint_position"], lift, std)
        parts.append((key[chosen], x[:, pose_columns], x[:, blocks["direction"]]))
    key, poses, directions = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.argsort(key, kind="stable")
    return key[order], poses[order], directions[order]


# Roll-outs in training: the network's own errors are added to its input poses, as at run time.


class RollOut(Augmentation):
    """Adds to the pose in X the errors that the network would have accumulated; Y is unchanged.

    At run time a joint's next position is the mean of two: the predicted position, and the old position plus
    the predicted velocity. Let d be the present error of the joint's position, and p and v the errors of the
    predicted position and velocity. In the next frame the joint's position is off by (d + v + p) / 2, and its
    velocity by v. So is a rotation by the error of the predicted one, if X has rotations. (The turn of the
    root between the frames, a few hundredths of a radian, is ignored.)

    Each place in a batch carries its errors to the same place in the next batch. There the row is usually of
    another clip, because rows are shuffled. The errors still have a realistic size and pattern over the
    joints. (If each row got the errors of its own past, the network would learn this past by heart, and the
    error on held-out clips would grow.)

    frames: length of a roll-out, at least 2. Its first pose is the captured one.
    """

    def __init__(self, database: Database, frames: int, places: range, device: torch.device) -> None:
        super().__init__(places, device)
        layout, s = database.layout, database.statistics
        self.frames, self.pose = frames, x_pose(layout.blocks("x"))
        self.joints = 3 * layout.joints
        self.y_blocks = layout.y_joint_position, layout.y_joint_velocity, layout.y_joint_rotation
        pairs = [
            (layout.x_joint_position, layout.y_joint_position),
            (layout.x_joint_position, layout.y_joint_velocity),
            (layout.x_joint_velocity, layout.y_joint_velocity),
        ]
        pairs += [(layout.x_joint_rotation, layout.y_joint_rotation)] if layout.local_phases else []
        # Factors that turn errors in standardised Y into errors in standardised X. For example,
        # `position_of_velocity` is for the error that a velocity in Y causes in a position in X.
        self.position_of_position, self.position_of_velocity, *self.of_themselves = (
            torch.from_numpy(s.y_std[of_y] / s.x_std[of_x]).to(device, torch.float32) for of_x, of_y in pairs
        )
        # The present errors of the pose in standardised X, for each place in the batch.
        self.errors = torch.zeros(len(places), len(self.pose), device=device)

    def begin_section(self) -> None:
        """As in `Augmentation`."""
        super().begin_section()
        self.errors.zero_()

    def change(self, batch: SampleBatch) -> None:
        """As in `Augmentation`."""
        batch.x[:, self.pose] += self.errors[: len(batch.x)]

    def after(self, error: Tensor) -> None:
        """As in `Augmentation`: advance the errors by a frame."""
        super().after(error)
        before = self.errors[: len(error), : self.joints]
        position, *others = (error[:, block] for block in self.y_blocks)
        added = position * self.position_of_position + others[0] * self.position_of_velocity
        now = joint_place(before, added)  # (d + p + v) / 2
        taken = [e * factor for e, factor in zip(others, self.of_themselves, strict=False)]
        self.errors[: len(error)] = torch.cat([now, *taken], dim=1)
        # After each batch, the roll-outs of every `frames`-th place end, so that not all end at once.
        self.errors[(self.batches - self.places.start) % self.frames :: self.frames] = 0
