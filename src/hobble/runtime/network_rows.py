"""The rows of the network: channel values and state become X; the output Y becomes a pose."""

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from hobble.channels import CHANNEL_NAMES, channel
from hobble.channels.shown import channel_display
from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.runtime.leg import turn_toward
from hobble.runtime.trajectory import Trajectory, joint_place


class UnknownName(KeyError):
    """The network does not have this gait or this label.

    A label names a column of a channel, such as the link "LeftUpLeg-LeftLeg" of the channel "injury".

    what: start of the message, such as "no gait". name: what the caller gave. known: the names that exist.
    The message lists the known names that are similar, or all of them if none is.
    """

    def __init__(self, what: str, name: object, known: Iterable[str]) -> None:
        names = list(known)
        similar = difflib.get_close_matches(str(name), names, 3, 0.5)
        hint = f"; did you mean {' or '.join(similar)}?" if similar else f": there are {', '.join(names)}"
        super().__init__(f"{what} {name!r}{hint}")

    def __str__(self) -> str:
        return str(self.args[0])


class ChannelValues:
    """Checks and converts values for the channels of a network.

    labels: channel -> label -> index of the label's column among those of the channel. columns: channel ->
    the channel's columns in the character's state, which holds all channels side by side. scales: channel ->
    number by which the caller's values are divided before the network gets them.
    """

    def __init__(self, network: Network, scales: Mapping[str, float]) -> None:
        columns = network.channels.items()
        self.labels = {name: {label: i for i, label in enumerate(own)} for name, own in columns}
        self._network = network
        self._names: dict[str, Mapping[str, str]] = {}  # channel -> other names -> label, once needed
        self.scales = dict(scales)
        self.columns: dict[str, slice] = {}
        start = 0
        for name, count in network.layout.channels:
            self.columns[name] = slice(start, start + count)
            start += count

    def convert(self, name: str, given: Any, characters: int) -> tuple[slice, Array]:
        """The columns of channel `name` in the character's state, and their new values (C, columns).

        given: label -> one value or (C,) values, where labels that are not named get the default; or an array
        (columns,) or (C, columns). characters: C. Raises the errors listed in
        `ProceduralAnimation.next_pose`.
        """
        if name not in CHANNEL_NAMES:
            raise TypeError(f"next_pose() got an unexpected keyword argument {name!r}")
        definition, labels = channel(name), self.labels.get(name, {})
        values = np.full((characters, len(labels)), definition.default)
        if isinstance(given, Mapping):
            for label, value in given.items():
                column = labels[self._label(name, label)]
                if (shape := np.shape(value)) not in ((), (1,), (characters,)):
                    one = f"{label} has to be one {definition.value_word} for all characters"
                    raise ValueError(f"{one}, or {characters}, one for each; its shape is {shape}")
                values[:, column] = value
        else:
            array = np.asarray(given, float)
            if not labels and array.size:
                raise ValueError(f"{array.size} numbers given for {name}, but {_no_input(name)}")
            if array.shape not in (values.shape, values.shape[1:]):
                either = f"{values.shape[1:]} or {values.shape}"
                raise ValueError(f"{name} has to have shape {either}, not {array.shape}")
            values[:] = array
        wrong = ~((values >= 0) & (values <= definition.highest))
        if wrong.any():
            c, k = np.argwhere(wrong)[0]
            what = f"the {definition.value_word} of {list(labels)[k]} is {values[c, k]:g}"
            raise ValueError(f"{what}, but has to be from 0 to {definition.highest:g}")
        return self.columns.get(name, slice(0, 0)), values / self.scales.get(name, 1.0)

    def _label(self, name: str, label: str) -> str:
        """The label of a column of channel `name`. label: it, or another name of it, such as "left knee".

        Raises ValueError or UnknownName if the network has no input of this name.
        """
        labels = self.labels.get(name, {})
        if not labels:
            raise ValueError(f"{label} cannot be set: {_no_input(name)}")
        if label in labels:
            return label
        if name not in self._names:
            skeleton, trained = self._network.skeleton, self._network.trained_labels(name)
            assert skeleton is not None, "a character has one"
            self._names[name] = channel_display(name, skeleton, list(labels), trained).other_names
        if label not in self._names[name]:
            raise UnknownName(f"{name} has no", label, labels)
        return self._names[name][label]


def _no_input(name: str) -> str:
    """The end of a message: what is wrong with channel `name`, and what to do."""
    return f"this network has no input for {name}; train a configuration with `channels: [{name}]`"


# Writes a character's state into the input row X of the network, and turns the output row Y into a pose.
#
# Every array begins with an axis of the C characters.


# Largest turn of a joint, radians a frame (1500 degrees a second). No joint of a walking or running person
# turns as fast, but a predicted joint may. If a joint has rotations in the clips that are half a turn apart,
# as in hands, the network predicts their mean, which may be any rotation. A new target may also change the
# predicted pose from one frame to the next.
FASTEST_TURN = np.radians(25)
# The body stands at the mean ground height along the path. When this height changes, the body rises or falls
# by at most this many cm a frame. On a hill, a new target may turn the path around. Then the mean may change
# by 20 cm in a frame, although the ground under the feet stays the same.
MOST_CLIMB = 5.0

# Groups of arrays for compiled functions, which unpack them into names.
#
# The last pose before foot placement, in the world: position, velocity (C, J, 3); rotation (C, J, 4).
Joints = tuple[Any, Any, Any]
# The copy of the pose that the caller gets: root (C, 3), yaw (C,), position (C, J, 3), rotation (C, J, 4).
Drawn = tuple[Any, Any, Any, Any]


@njit
def write_inputs(
    path: Trajectory, ground: Any, height: Any, pose: Joints, first: Any, step: int, x: Any
) -> None:
    """Write the state, without channels, into the network's input rows x (C, X), not standardised.

    ground: (C, samples, 3) ground heights left of the path, on it and right of it. height: (C,) mean ground
    height along the path. first: first column of each block of `hobble.rows.layout.BODY`: position 0,
    direction 1, gait 2, joint_position 3, joint_velocity 4 and terrain 5. step: frames between two samples of
    the trajectory.
    """
    position, direction, gait = path
    joints, velocities, _ = pose
    middle, samples = position.shape[1] // 2, ground.shape[1]
    for c in range(x.shape[0]):
        # The trajectory is relative to the present root.
        px, pz = position[c, middle]
        cos, sin = direction[c, middle, 1], direction[c, middle, 0]
        for s in range(samples):
            dx, dz = position[c, s * step, 0] - px, position[c, s * step, 1] - pz
            x[c, first[0] + s] = dx * cos - dz * sin
            x[c, first[0] + samples + s] = dx * sin + dz * cos
            dx, dz = direction[c, s * step]
            x[c, first[1] + s] = dx * cos - dz * sin
            x[c, first[1] + samples + s] = dx * sin + dz * cos
            for g in range(gait.shape[2]):
                x[c, first[2] + g * samples + s] = gait[c, s * step, g]
            for side in range(3):
                x[c, first[5] + side * samples + s] = ground[c, s, side] - height[c]
        # The pose is still that of the frame before, and relative to the root of that frame.
        px, pz = position[c, middle - 1]
        cos, sin = direction[c, middle - 1, 1], direction[c, middle - 1, 0]
        for j in range(joints.shape[1]):
            dx, dz = joints[c, j, 0] - px, joints[c, j, 2] - pz
            k = first[3] + 3 * j
            x[c, k], x[c, k + 2] = dx * cos - dz * sin, dx * sin + dz * cos
            x[c, k + 1] = joints[c, j, 1] - height[c]
            dx, dz = velocities[c, j, 0], velocities[c, j, 2]
            k = first[4] + 3 * j
            x[c, k], x[c, k + 1], x[c, k + 2] = dx * cos - dz * sin, velocities[c, j, 1], dx * sin + dz * cos


@njit
def write_poses(
    y: Any, first: int, path: Trajectory, heights: tuple[Any, Any], pose: Joints, fastest: float, drawn: Drawn
) -> None:
    """Turn the prediction y (C, Y) into the world poses `pose` and `drawn`, which are changed in place.

    first: first column of the joints in y. heights: two arrays (C,): mean ground height along the path, and
    body lift, which is how far the body is raised above the predicted pose, cm. The lift is changed so that
    the body rises or falls by at most MOST_CLIMB. fastest: largest movement of a joint, cm a frame, apart
    from the change of the mean ground height.

    A new joint position is the mean of two: the predicted position, and the old position plus the predicted
    velocity. No joint turns by more than FASTEST_TURN.
    """
    position, direction, _ = path
    joints, velocities, rotations = pose
    root, yaw, pose_position, pose_rotation = drawn
    height, lift = heights
    middle, count = position.shape[1] // 2, joints.shape[1]
    for c in range(y.shape[0]):
        sin, cos = direction[c, middle, 0], direction[c, middle, 1]
        climbed = height[c] - root[c, 1]
        lift[c] += min(max(climbed, -MOST_CLIMB), MOST_CLIMB) - climbed
        root[c, 0], root[c, 1], root[c, 2] = position[c, middle, 0], height[c], position[c, middle, 1]
        yaw[c] = np.arctan2(sin, cos)
        half_cos, half_sin = np.cos(yaw[c] / 2), np.sin(yaw[c] / 2)
        for j in range(count):
            # First columns of the joint's position, velocity and rotation.
            p = first + 3 * j
            v, r = p + 3 * count, p + 6 * count
            velocities[c, j, 0] = y[c, v] * cos + y[c, v + 2] * sin
            velocities[c, j, 1] = y[c, v + 1]
            velocities[c, j, 2] = y[c, v + 2] * cos - y[c, v] * sin
            new_x = y[c, p] * cos + y[c, p + 2] * sin + root[c, 0]
            new_z = y[c, p + 2] * cos - y[c, p] * sin + root[c, 2]
            _move_joint(
                joints[c, j], velocities[c, j], new_x, y[c, p + 1] + root[c, 1], new_z, climbed, fastest
            )
            _turn_joint(rotations[c, j], y[c, r], y[c, r + 1], y[c, r + 2], half_cos, half_sin)
            for k in range(3):
                pose_position[c, j, k] = joints[c, j, k]
            for k in range(4):
                pose_rotation[c, j, k] = rotations[c, j, k]


@njit
def _move_joint(
    place: Any, velocity: Any, x: float, y: float, z: float, climbed: float, fastest: float
) -> None:
    """Move the joint position `place` (3,) toward the predicted position x, y, z, by at most `fastest` cm.

    velocity: (3,) predicted. climbed: change of the mean ground height, cm, which does not count toward
    `fastest`.
    """
    sx = joint_place(place[0] + velocity[0], x) - place[0]
    sy = joint_place(place[1] + velocity[1], y) - place[1]
    sz = joint_place(place[2] + velocity[2], z) - place[2]
    moved = np.sqrt(sx * sx + (sy - climbed) ** 2 + sz * sz)
    if moved > fastest:
        sx, sy, sz = sx * fastest / moved, climbed + (sy - climbed) * fastest / moved, sz * fastest / moved
    place[0] += sx
    place[1] += sy
    place[2] += sz


@njit
def _turn_joint(rotation: Any, x: float, y: float, z: float, half_cos: float, half_sin: float) -> None:
    """Turn `rotation` (4,), a joint's world rotation, to the predicted rotation, by at most FASTEST_TURN.

    x, y, z: the predicted axis times half the angle, relative to the root. half_cos, half_sin: cosine and
    sine of half the root's yaw.
    """
    half = np.sqrt(x * x + y * y + z * z)
    scale = np.sin(half) / half if half > 1e-8 else 1.0
    w, x, y, z = np.cos(half), x * scale, y * scale, z * scale
    # From the root's axes to the world: turn by the root's yaw.
    w, x, y, z = (
        half_cos * w - half_sin * y,
        half_cos * x + half_sin * z,
        half_cos * y + half_sin * w,
        half_cos * z - half_sin * x,
    )
    turn_toward(rotation, w, x, y, z, FASTEST_TURN)
