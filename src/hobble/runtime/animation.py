"""The public character: load it once, then call `next_pose` every frame."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.core import quat
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.caller_axes import Axes
from hobble.runtime.caller_targets import CallerTargets
from hobble.runtime.channel_values import ChannelValues
from hobble.runtime.character import Character, Snapshot, start
from hobble.runtime.controller import Controller, ControllerOptions
from hobble.runtime.ground import as_ground
from hobble.runtime.limits import SpeedLimiter
from hobble.runtime.trajectory import target_facing
from hobble.runtime.waypoints import Follower, Waypoint

FARTHEST = 1e7  # cm, 100 km: largest start coordinate; farther from the origin, floats are imprecise


@dataclass(frozen=True)
class Pose:
    """One frame of C characters. The caller may keep and change it. For one character there is no axis C.

    positions: (C, J, 3) world, in the caller's axes and unit. rotations: (C, J, 4) world, w first.
    contacts: (C, 4) of left heel, left toe, right heel, right toe, from 0 to 1, as predicted; 0 while the
    runtime makes the foot step. phase: (C,) in cycles. root: (C, 3) on the ground. yaw: (C,) radians, where
    the root faces: 0 is +Z, growing to the left, in Hobble's axes. channels: name -> (C, columns), the values
    that the network got.
    """

    positions: Array = field(repr=False)
    rotations: Array = field(repr=False)
    contacts: Array
    phase: Any
    root: Array
    yaw: Any
    channels: Mapping[str, Array] = field(repr=False)


class ProceduralAnimation:
    """One or many characters driven by one network.

        character = ProceduralAnimation.load("results/injured/network")
        pose = character.next_pose((0, 2.5), injury={"LeftUpLeg-LeftLeg": 7})

    One call moves all C characters. An argument is either one value for all of them or one value for each.
    """

    def __init__(
        self,
        network: Network,
        *,
        mode: str = "cubic",
        storage: str | None = None,
        characters: int = 1,
        waypoints: Sequence[Waypoint] | None = None,
        rates: Mapping[str, float] | None = None,
        scales: Mapping[str, float] | None = None,
        foot_locking: bool = True,
        steering: float = 2.0,
        limits: bool = True,
        axes: Axes | None = None,
        position: Any = None,
        facing: Any = None,
    ) -> None:
        if network.skeleton is None:
            raise ValueError("the network has no skeleton: load it with skeleton=")
        for name, value, least in (
            ("characters", characters, 1),
            ("steering", steering, 0),
            *((f"the rate of {name}", value, 1e-9) for name, value in (rates or {}).items()),
            *((f"the scale of {name}", value, 1e-9) for name, value in (scales or {}).items()),
        ):
            if not least <= value < np.inf:
                bound = f"{least} or more" if least in (0, 1) else "more than 0"
                raise ValueError(f"{name} is {value!r}, but has to be {bound}")
        self.network, self.skeleton = network, network.skeleton
        self.characters, self.axes = characters, axes or Axes()
        self._channel_values = ChannelValues(network, scales or {})
        self._limited = limits
        self._of_controller: ControllerOptions = {
            "rates": {name: channel(name).rate for name in network.channels} | dict(rates or {}),
            "foot_locking": foot_locking,
            "steering": steering,
            "side": network.terrain_side,
        }
        self._predictor = network.predictor(mode, storage)
        self._waypoints = list(waypoints) if waypoints is not None else None
        self._contacts = network.layout.y_contacts
        self._targets = CallerTargets(network.gaits, self.axes, characters)
        for waypoint in self._waypoints or ():
            self._targets.check_gait(waypoint.gait)
        self._terrain: tuple[Any, Any] = (None, None)
        self.reset(position, facing)

    @classmethod
    def load(
        cls, path: str | Path, *, skeleton: Skeleton | str | Path | None = None, **options: Any
    ) -> ProceduralAnimation:
        """Load weights.npz, its folder, or a folder with the .bin files of Holden et al. (2017).

        skeleton: a Skeleton or a file of config/skeletons, for a network file that has none.
        mode: how the weights are interpolated over the phase: "constant", "linear" or "cubic".
        storage: how weights are stored in memory, "float32" or "int16"; the default depends on the kind of
            network.
        characters: how many.
        waypoints: the track to follow when `next_pose` gets no velocity.
        rates: channel -> largest change of its values per second; default: the channel's own rate.
        scales: channel -> number by which its values are divided for the network.
        foot_locking: hold feet in contact where they landed.
        steering: gain of the correction when the target velocity is not reached; 0: none, as in the
            runtime of Holden et al. (2017).
        limits: limit the target speed to what the injured body can do.
        axes: the caller's axes and unit. position, facing: see `reset`.

        Raises InputError for a file that is not a usable network, ValueError for an option out of range, and
        UnknownName for a waypoint's gait that the network does not have.
        """
        network = load_network(path, skeleton)
        if network.skeleton is None:
            fix = f"Pass skeleton= with {network.layout.joints} joints, such as a file of config/skeletons."
            raise InputError(path, "has no skeleton", fix=fix)
        return cls(network, **options)

    def reset(self, position: Any = None, facing: Any = None) -> None:
        """Restart the characters, healthy, at `position` and facing `facing`, each (3,) or (C, 3).

        By default they start at the origin facing forward, or at the start of the waypoints.
        """
        count = self.characters
        self.follower = Follower(self._waypoints, count) if self._waypoints is not None else None
        place, yaw = self.follower.start if self.follower else (np.zeros(2), 0.0)
        places = (
            np.broadcast_to(place, (count, 2))
            if position is None
            else self._targets.on_the_ground("position", position, self.axes.points_in)
        )
        if np.abs(places).max() > FARTHEST:
            raise ValueError(f"position is further than {FARTHEST / 1e5:g} km from the origin: {position}")
        if facing is None:
            yaws = np.full(count, yaw)
        else:
            ahead = self._targets.facing(facing)
            yaws = np.arctan2(ahead[:, 0], ahead[:, 1])
        self._control(start(self.network, count, np.array(places, float), yaws))

    def copies(self, of: np.ndarray) -> ProceduralAnimation:
        """A new animation whose character i continues from character of[i] of this one. of: (C',) indices.

        The two animations share no state. Raises ValueError if the characters follow waypoints.
        """
        if self.follower is not None:
            raise ValueError("characters that follow waypoints cannot be copied")
        out = copy.copy(self)
        out.characters = len(of)
        out._targets = CallerTargets(self.network.gaits, self.axes, len(of))
        out._control(self.state.copies(of))
        out._controller.take_pose(self._controller, of)
        return out

    def _control(self, state: Character) -> None:
        """Continue from `state`, with a new controller."""
        count = self.characters
        self.state = state
        self._controller = Controller(self._predictor, state, **self._of_controller)
        self._target_strafe, self._target_look = np.zeros(count), np.zeros((count, 2))
        self._nowhere = np.zeros((count, 2))
        self._limiter = SpeedLimiter(self.network, self._channel_values.columns, count)

    @property
    def seconds(self) -> Array:
        """(6,) seconds of the last frame's steps: prepare, input, insert, predict, output, update."""
        return self._controller.seconds

    @property
    def last_inputs(self) -> Array:
        """(C, X) inputs of the network in the last frame, in raw units. The next frame overwrites them."""
        return self._controller.x

    @property
    def predicted_rotations(self) -> Array:
        """(C, J, 4) world rotations that the network predicted for the last frame.

        Here it is not yet limited how far a joint turns in a frame. In Hobble's axes: Y up, Z forward.
        """
        return world_rotations(*self.predicted_turns)

    @property
    def predicted_turns(self) -> tuple[Array, Array]:
        """Rotations (C, J, 3) predicted for the last frame, relative to the root, and the root's yaw (C,).

        Both are copies. Collect those of many frames and pass them to `world_rotations` at once: this is
        faster than `predicted_rotations`.
        """
        controller = self._controller
        turns = controller.y[:, self.network.layout.y_joint_rotation].reshape(self.characters, -1, 3)
        return turns.copy(), controller.yaw.copy()

    def next_pose(
        self,
        target_velocity: Any = None,
        facing: Any = None,
        gait: str | Sequence[str] | Array | None = None,
        *,
        terrain: Any = None,
        **channels: Mapping[str, Any] | Array | None,
    ) -> Pose:
        """Advance by one 60 Hz frame and return the pose.

        target_velocity: (2,) on the ground, (3,), or (C, 2 or 3): distance per frame, in your unit. None
            follows the waypoints; without waypoints the character stands.
        facing: direction to look in, same shapes, any length. None or zero: the direction of movement.
        gait: a name ("walk"), one name for each character, shares (6,) or (C, 6), or None to choose by speed.
            Below 0.1 cm a frame the character stands, whatever the gait.
        terrain: None for flat ground at 0; a function of two ground coordinates (arrays) that returns
            heights; a `ground.Heightmap`; or a 2D array of heights around the origin. Coordinates and heights
            are in your axes and unit. Pass the same object every frame.
        channels: keywords named after channels, such as injury={"LeftUpLeg-LeftLeg": 7}. The value is a
            mapping from label (column of the channel) to value or (C,) values, or an array (L,) or (C, L) of
            all L labels. Labels that are not named go back to 0. None, or no keyword, leaves the channel
            unchanged.

        Raises UnknownName (a KeyError) for a label or gait that the network does not have; TypeError for a
        keyword that is no channel; ValueError for a channel that the network has no input for, for values out
        of range (velocity above 18 m/s, gait share above 1, ground above 100 km), for values that are not
        finite and for wrong shapes. After any error, also in the terrain function, the state is unchanged.
        """
        velocity, ahead, gait = self._target(target_velocity, facing, gait)
        strafe, direction = self._target_strafe, self._target_look
        target_facing(velocity, ahead, self.state.smoothed_direction, strafe, direction)
        heading = self.state.direction[:, self.network.layout.window]
        shares = self._targets.gait_shares(velocity, direction, heading, gait)
        if terrain is not self._terrain[0]:
            self._terrain = (terrain, as_ground(terrain, self.axes))
        targets = [
            self._channel_values.values(name, given, self.characters)
            for name, given in channels.items()
            if given is not None
        ]
        controller = self._controller
        before = None if self._terrain[1] is None else Snapshot(self.state, controller.root, controller.yaw)
        try:
            for columns, values in targets:
                self.state.channel_targets[:, columns] = values
            if self._limited:
                self._limiter.limit(self.state.channel_values, velocity, shares)
            controller.frame((velocity, direction, strafe, shares), self._terrain[1])
        except BaseException:
            if before is not None:  # on flat ground nothing in a frame can fail
                before.restore()
            raise
        return self._pose()

    def _target(self, velocity: Any, facing: Any, gait: Any) -> tuple[Array, Array, Any]:
        """Target velocity (C, 2), facing (C, 2) and gait, from the caller or the waypoints.

        A facing of zero means: look where the character goes.
        """
        ahead = self._nowhere if facing is None else self._targets.facing(facing)
        if velocity is not None:
            return self._targets.velocity(velocity), ahead, gait
        if self.follower is None:
            return np.zeros((self.characters, 2)), ahead, gait
        middle = self.network.layout.window
        target, waypoints = self.follower.lead(self.state.position[:, middle])
        ahead = target
        if any(waypoint.facing is not None for waypoint in waypoints):
            ahead = target.copy()
            for c, waypoint in enumerate(waypoints):
                if waypoint.facing is not None:
                    ahead[c] = waypoint.facing
        return target, ahead, [waypoint.gait for waypoint in waypoints] if gait is None else gait

    def _pose(self) -> Pose:
        c, state = self._controller, self.state
        positions, rotations, root = c.pose_position.copy(), c.pose_rotation.copy(), c.root.copy()
        if not self.axes.native:
            positions[:], root[:] = self.axes.points_out(positions), self.axes.points_out(root)
            rotations = self.axes.rotations_out(rotations)
        contacts = np.minimum(np.maximum(c.y[:, self._contacts], 0), 1)
        channels = {
            name: state.channel_values[:, columns].copy()
            for name, columns in self._channel_values.columns.items()
        }
        if self.characters > 1:
            return Pose(positions, rotations, contacts, state.phase.copy(), root, c.yaw.copy(), channels)
        return Pose(
            positions[0],
            rotations[0],
            contacts[0],
            float(state.phase[0]),
            root[0],
            float(c.yaw[0]),
            {name: values[0] for name, values in channels.items()},
        )


def world_rotations(turns: Array, yaw: Array) -> Array:
    """(..., J, 4) world rotations of joints.

    turns: (..., J, 3) axis times half the angle, relative to the root. yaw: (...) radians, where the root
    faces.
    """
    return quat.mul(quat.yaw(yaw)[..., None, :], quat.exp(turns.astype(float)))
