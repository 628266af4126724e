"""The controller: one frame of each character, from its targets to its pose, and its trajectory moved on.

A trajectory is the character's path on the ground, half past and half future. The compiled functions are in
one file, because numba compiles a cached function again only if its own file changes. A change in the file of
a function that it calls is not noticed.
"""

from collections.abc import Callable, Mapping
from time import perf_counter
from typing import Any

import numpy as np

from hobble.channels.channel import read_through_curve
from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.models.network import Predictor
from hobble.rows.layout import BODY, RowLayout
from hobble.runtime import feet, leg, network_rows, trajectory
from hobble.runtime.bounds import Bounds, limit_rows
from hobble.runtime.character import Character
from hobble.runtime.trajectory import STILL, Trajectory, movement_share, phase_change
from hobble.runtime.variation import find_arms, swing_arms

# If the predicted poses are recorded frames (motion matching), the root's movement in a frame is changed
# toward the target velocity. At right angles to the target, the change is at most this share of the
# movement's length.
PULL = 0.2
# Along the target, the change is at most PULL * PULL_AHEAD times the movement's length. With a higher limit,
# the character takes corners faster and wider.
PULL_AHEAD = 0.5
# With other networks, if the predicted movement goes against the target, this share of its backward part is
# removed. If all of it were removed, the feet would slide.
BACKWARD_LOSS = 0.5
# And if the body fell behind the target, it is pushed by what its speed lacks, at most MOST_PUSH cm a frame.
# Without a push, characters that were asked for a slow walk went backward, and did not come out of it.
MOST_PUSH = 0.3


@njit
def _pull_to_target(
    share: float, target_x: float, target_z: float, x: float, z: float
) -> tuple[float, float]:
    """What to add to the root's movement (x, z) in a frame to bring it nearer to the target movement.

    At right angles to the target, at most `share` times the movement's length is added. Along the target, the
    limit is PULL_AHEAD times as high. If the two directions shared one limit, a recorded clip that is too
    slow would use it up, and the character would drift off its path. If the target is slower than STILL, it
    has no direction, and the first limit applies to everything.
    """
    most = share * np.sqrt(x * x + z * z)
    size = np.sqrt(target_x * target_x + target_z * target_z)
    ahead_x, ahead_z = (target_x / size, target_z / size) if size >= STILL else (0.0, 0.0)
    lack_x, lack_z = target_x - x, target_z - z
    along = lack_x * ahead_x + lack_z * ahead_z
    lack_x, lack_z = lack_x - along * ahead_x, lack_z - along * ahead_z  # what is left is across the target
    along = min(max(along, -PULL_AHEAD * most), PULL_AHEAD * most)
    across_share = min(1.0, most / max(np.sqrt(lack_x * lack_x + lack_z * lack_z), 1e-9))
    return along * ahead_x + across_share * lack_x, along * ahead_z + across_share * lack_z


@njit
def _keep_up(
    loss: float, target_x: float, target_z: float, x: float, z: float, past: Any
) -> tuple[float, float]:
    """The root's movement (x, z) in a frame, so that the body follows its target; unchanged if `loss` is 0.

    The share `loss` of its part against the target is removed. If the target is slower than STILL, that is
    the share `loss` of the whole movement. Besides, a body that fell behind is pushed ahead. past: (N, 2)
    places of the last frames. Their mean speed counts, since the speed of a walk varies in each step.
    """
    squared_speed = target_x * target_x + target_z * target_z
    if loss == 0.0 or squared_speed < STILL * STILL:
        return (1.0 - loss) * x, (1.0 - loss) * z
    more = -loss * min(0.0, x * target_x + z * target_z) / squared_speed
    last = len(past) - 1
    way_x, way_z = past[last, 0] - past[0, 0], past[last, 1] - past[0, 1]
    lack = 1.0 - (way_x * target_x + way_z * target_z) / (last * squared_speed)  # as a share of the target
    more += min(max(lack, 0.0), MOST_PUSH / np.sqrt(squared_speed))
    return x + more * target_x, z + more * target_z


@njit
def advance(
    y: Any,
    columns: Any,
    target: Any,
    loss: float,
    recorded_poses: bool,
    pull: float,
    path: Trajectory,
    phase: Any,
) -> None:
    """Advance the trajectories and phases of C characters by one frame.

    The past is shifted by a frame. The root moves and turns, the future becomes the predicted one, and the
    phase changes, all as the network predicts. The network predicts the turn of the world seen from the root,
    so the root turns by the negative.
    y: (C, Y) prediction. columns: see `advance_columns`. target: (C, 2) target velocity, cm a frame.
    loss: see `_keep_up`; 0 in the runtime of Holden et al. (2017). recorded_poses: whether the predicted
    poses are recorded frames. If not, movement and turn are scaled by (1 - stand)^.25, where stand is the
    present share of the gait "stand", and the phase changes more slowly. pull: largest change of the movement
    at right angles to the target, as a share of the movement's length; 0 for no change. Recorded frames need
    it, because clips have only some directions and speeds. The idea is the adjustment of Holden et al.
    (2020).
    path: the trajectories, see `hobble.runtime.trajectory.Trajectory`. phase: (C,). Both change in place.
    """
    position, direction, gait = path
    length = position.shape[1]
    middle = length // 2  # the present frame
    velocity_column, turn_column, change_column, position_column, direction_column, future, step = columns
    for c in range(y.shape[0]):
        for i in range(middle):
            for k in range(2):
                position[c, i, k] = position[c, i + 1, k]
                direction[c, i, k] = direction[c, i + 1, k]
            for k in range(gait.shape[2]):
                gait[c, i, k] = gait[c, i + 1, k]
        moving = 1.0 if recorded_poses else movement_share(gait[c, middle, 0])
        yaw = np.arctan2(direction[c, middle, 0], direction[c, middle, 1])
        sin, cos = np.sin(yaw), np.cos(yaw)
        vx, vz = y[c, velocity_column], y[c, velocity_column + 1]
        # From root coordinates to the world.
        x, z = moving * (vx * cos + vz * sin), moving * (vz * cos - vx * sin)
        asked_x, asked_z = moving * target[c, 0], moving * target[c, 1]
        x, z = _keep_up(loss, asked_x, asked_z, x, z, position[c, :middle])
        more_x, more_z = _pull_to_target(pull, target[c, 0], target[c, 1], x, z)
        position[c, middle, 0] += x + more_x
        position[c, middle, 1] += z + more_z
        yaw -= moving * y[c, turn_column]
        sin, cos = np.sin(yaw), np.cos(yaw)
        direction[c, middle, 0], direction[c, middle, 1] = sin, cos
        for i in range(middle + 1, length):
            # Interpolate between the predicted samples k and k + 1; m is the weight of sample k + 1. Beyond
            # the last sample, extrapolate the line through the last two.
            place = (i - middle) / step
            k = min(int(place), future - 2)
            m = place - k
            p, d = position_column + k, direction_column + k
            x = (1 - m) * y[c, p] + m * y[c, p + 1]
            z = (1 - m) * y[c, p + future] + m * y[c, p + future + 1]
            position[c, i, 0] = position[c, middle, 0] + x * cos + z * sin
            position[c, i, 1] = position[c, middle, 1] + z * cos - x * sin
            x = (1 - m) * y[c, d] + m * y[c, d + 1]
            z = (1 - m) * y[c, d + future] + m * y[c, d + future + 1]
            norm = max(np.sqrt(x * x + z * z), 1e-6)
            direction[c, i, 0] = (x * cos + z * sin) / norm
            direction[c, i, 1] = (z * cos - x * sin) / norm
        change = phase_change(moving, y[c, change_column])
        phase[c] = phase[c] + change - np.floor(phase[c] + change)


def advance_columns(layout: RowLayout) -> tuple[int, ...]:
    """The argument `columns` (7,) of `advance`.

    These are the first columns in Y of root velocity, turn, phase change, position and direction, then the
    number of future samples, and the number of frames from one sample to the next.
    """
    blocks = (
        layout.y_root_velocity, layout.y_turn, layout.y_phase_change, layout.y_position, layout.y_direction
    )  # fmt: skip
    return (*(b.start for b in blocks), layout.future, layout.step)


# One frame of a character in six timed steps: prepare, input, insert, predict, output, update.
#
# - prepare: smooth the caller's target, bend the future trajectory toward it, look up the ground;
# - input: write trajectory, gait, ground, last pose and channel values into the input row X, in root
#   coordinates;
# - insert: standardise the row;
# - predict: evaluate the network at the present phase, which gives the output row Y;
# - output: turn Y into a world pose, and place the feet in the copy that the caller gets;
# - update: advance root, past and future trajectory, and phase by one frame.


STEPS = ("prepare", "input", "insert", "predict", "output", "update")
FPS = 60
FEET_AHEAD = 4.0  # frames: a foot in the air is kept above the ground that it reaches in this time
HIGHEST_GROUND = 1e7  # cm, 100 km above or below 0; at larger heights, floats are imprecise

Ground = Callable[[Array, Array], Array]  # x, z (N,), cm -> heights (N,), cm


class Controller:
    """Runs the characters of one network.

    character: their state, changed in place. options: rates, foot_locking and steering. rates: channel ->
    largest change of its values per second. foot_locking: hold feet in contact where they landed. steering:
    gain with which the target velocity is corrected while the character does not reach it; 0: no correction.

    After `advance_frame`, these are the pose for the caller: root (C, 3), yaw (C,), pose_position (C, J, 3)
    and pose_rotation (C, J, 4). The attributes x, z and y are the rows of inputs, of
    standardised inputs and of outputs. seconds: (6,) how long each of STEPS took.
    """

    def __init__(
        self, predictor: Predictor, character: Character, options: tuple[Mapping[str, float], bool, float]
    ) -> None:
        network, (rates, self.foot_locking, self.steering) = predictor.network, options
        layout = network.layout
        count = len(character.phase)
        self.predictor, self.character, self.layout = predictor, character, layout
        self.side = network.terrain_side
        self.seconds = np.zeros(len(STEPS))
        self.x = np.zeros((count, layout.x_size), np.float32)
        self.z = np.zeros_like(self.x)
        self.y = np.zeros((count, layout.y_size), np.float32)
        here, ahead = character.position[:, layout.window], character.direction[:, layout.window]
        self.root = np.stack([here[:, 0], character.root_height, here[:, 1]], axis=1)
        self.yaw = np.arctan2(ahead[:, 0], ahead[:, 1])
        self.bounds = Bounds.of(network)
        # Factors of the next change of phase and of the channel values, see `hobble.runtime.variation`.
        self.pace, self.shown = np.ones(count), np.ones(count)
        self._memory = character.memory if network.memory_size else None
        self.pose_position = character.joint_position.copy()
        self.pose_rotation = character.joint_rotation.copy()
        # x and z of the points left of the path, on it and right of it where the ground is looked up.
        self._points = np.zeros((count, layout.samples, 3, 2))
        blocks = layout.blocks("x")
        self._x_starts = np.array([blocks[name].start for name in BODY], np.int64)
        channel_columns = [np.arange(layout.x_size)[layout.x_channel(name)] for name, _ in layout.channels]
        self._x_channels = np.concatenate([np.zeros(0, np.int64), *channel_columns])
        self._channel_curves = network.channel_curves
        # The largest change of each channel value in a frame.
        channel_steps = [np.full(columns, rates[name] / FPS) for name, columns in layout.channels]
        self._channel_steps = np.concatenate([np.zeros(0), *channel_steps])
        self._y_columns = advance_columns(layout)
        self._y_joints = layout.y_joint_position.start
        assert network.skeleton is not None
        legs = leg.leg_joints(network.skeleton)
        parts, ahead = feet.foot_parts(network.skeleton, legs), leg.rest_facing(network.skeleton)
        self._legs = legs, parts, feet.sole_heights(network, legs), ahead, self.bounds.fastest
        self._hips, self._arms = network.skeleton.role("hips"), find_arms(network.skeleton)
        self._hips_range = (*self.bounds.hips, self.bounds.upright)
        # The joints under which the ground is looked up (heels, toes, hips), and the ground heights there.
        self._ground_joints = np.append(legs[:, 2:].reshape(-1), self._hips)
        self._ground_heights = np.zeros((count, len(self._ground_joints)))
        self._group_arrays(character)

    def _group_arrays(self, c: Character) -> None:
        """Group the arrays for the compiled functions. Once is enough: the arrays only change in place."""
        self._path = (c.position, c.direction, c.gait)
        self._smoothed = (c.smoothed_velocity, c.smoothed_direction, c.strafe, c.correction, c.earlier)
        self._channels = (c.channel_values, c.channel_targets, self._channel_steps)
        self._joints = (c.joint_position, c.joint_velocity, c.joint_rotation)
        self.drawn = (self.root, self.yaw, self.pose_position, self.pose_rotation)
        self._feet = (
            (c.foot_lock, c.foot_hold, c.foot_step, c.foot_missed),
            *(c.foot_lift, c.foot_added, c.leg_shown, c.root_height, c.body_lift, c.hips_sink, c.knee_more),
        )
        self._contacts = self.y[:, self.layout.y_contacts]
        self._predicted_hips = self.y[:, self._y_joints + 3 * self._hips + 1]

    def advance_frame(self, target: trajectory.Target, ground: Ground | None) -> None:
        """Run one frame. ground: function from x, z (N,) to heights (N,), cm; None: flat at 0."""
        clock = perf_counter
        t0 = clock()
        c = self.character
        self._prepare(target, ground)
        t1 = clock()
        self._input()
        limit_rows(self.x, self.bounds.x_low, self.bounds.x_high)
        t2 = clock()
        self.predictor.standardise(self.x, self.z)
        t3 = clock()
        self.predictor.evaluate(self.z, c.phase, self.y, self._memory)
        limit_rows(self.y, self.bounds.y_low, self.bounds.y_high)
        t4 = clock()
        self._output(ground)
        t5 = clock()
        self._update(target[0])
        t6 = clock()
        self.seconds[:] = (t1 - t0, t2 - t1, t3 - t2, t4 - t3, t5 - t4, t6 - t5)

    def _prepare(self, target: trajectory.Target, ground: Ground | None) -> None:
        c = self.character
        trajectory.prepare(
            target, self.steering, self._smoothed, self._path, self._channels, self.layout.step, self.side,
            self._points,
        )  # fmt: skip
        if ground is None:
            c.ground.fill(0.0)
        else:
            points = self._points.reshape(-1, 2)
            c.ground[:] = heights_at(ground, points[:, 0], points[:, 1]).reshape(c.ground.shape)
        trajectory.write_mean_height(c.ground, c.root_height)
        if not c.placed.all():  # once, at the start: lift the joints to the ground, which may have any height
            c.joint_position[..., 1] += c.root_height[:, None]
            self.root[:, 1] = c.root_height
            c.placed[:] = True

    def _input(self) -> None:
        c = self.character
        network_rows.write_inputs(
            self._path, c.ground, c.root_height, self._joints, self._x_starts, self.layout.step, self.x
        )
        self.x[:, self._x_channels] = read_through_curve(
            c.channel_values * self.shown[:, None], *self._channel_curves
        )

    def _output(self, ground: Ground | None) -> None:
        c = self.character
        network_rows.write_poses(
            self.y, self._y_joints, self._path, (c.root_height, c.body_lift), self._joints,
            self.bounds.fastest, self.drawn,
        )  # fmt: skip
        if ground is not None:
            at = self.pose_position[:, self._ground_joints]
            # A held foot is not where the network predicts it, but where it is held.
            toes = at[:, [1, 3]][..., ::2]
            share = feet.held_share(c.foot_lock)
            away = share[..., None] * (c.foot_hold - toes)
            at[:, :4, ::2] += np.repeat(away, 2, axis=1)
            # A foot in the air rises in time for the ground that it will be over.
            free = np.repeat(1.0 - share, 2, axis=1)[..., None]
            ahead = at[:, :4] + FEET_AHEAD * free * c.joint_velocity[:, self._ground_joints[:4]]
            points = np.concatenate([at, ahead], axis=1).reshape(-1, 3)
            heights = heights_at(ground, points[:, 0], points[:, 2]).reshape(len(at), 9)
            self._ground_heights[:] = heights[:, :5]
            self._ground_heights[:, :4] = np.maximum(heights[:, :4], heights[:, 5:])
        else:
            self._ground_heights[:] = 0.0
        feet.carry_body(
            self._contacts, self._ground_heights, self._hips, self._hips_range,
            self._predicted_hips, self._legs, c.body_lift, self.pose_position,
        )  # fmt: skip
        if c.arm_more.any():
            swing_arms(self._arms, c.arm_more, c.arm_mean, *self.drawn[1:])
        feet.place_feet(
            self._contacts, self._ground_heights, self.foot_locking, self._legs, self._feet,
            self.pose_position, self.pose_rotation,
        )  # fmt: skip

    def _update(self, velocity: Array) -> None:
        recorded_poses = self.predictor.network.plays_recorded_poses
        steered = self.steering > 0  # otherwise the root moves as predicted
        loss = BACKWARD_LOSS if steered and not recorded_poses else 0.0
        pull = PULL if steered and recorded_poses else 0.0
        self.y[:, self.layout.y_phase_change] *= self.pace[:, None]
        advance(
            self.y, self._y_columns, velocity, loss, recorded_poses, pull, self._path, self.character.phase
        )


def heights_at(ground: Ground, x: Array, z: Array) -> Array:
    """Heights (N,) of the caller's ground at x, z (N,), cm.

    Raises ValueError for a wrong shape, and for heights that are not finite or too large, because they would
    stay in the characters' state.
    """
    heights = np.asarray(ground(x, z), float)
    if heights.shape not in ((), x.shape):
        raise ValueError(f"the terrain returned heights of shape {heights.shape} for {x.size} points")
    if not np.isfinite(heights).all():
        raise ValueError("the terrain has heights that are not finite")
    if (highest := np.abs(heights).max()) > HIGHEST_GROUND:
        raise ValueError(f"the terrain has a height of {highest:.4g} cm; {HIGHEST_GROUND:g} cm at most")
    return np.broadcast_to(heights, x.shape)
