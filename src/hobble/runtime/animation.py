"""The character for games and other callers: load it once, then call `next_pose` in every frame."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.channels import channel
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.bounds import SpeedLimiter
from hobble.runtime.caller_targets import Axes, CallerTargets, Pose
from hobble.runtime.character import Character, start_characters
from hobble.runtime.controller import Controller, heights_at
from hobble.runtime.error_calculator import Compared, compare
from hobble.runtime.ground import as_ground
from hobble.runtime.layers import Layers
from hobble.runtime.network_rows import ChannelValues
from hobble.runtime.stairs import joins, leg_of_columns, time_steps
from hobble.runtime.trajectory import target_facing
from hobble.runtime.variation import count_steps, mix_swing, vary_step
from hobble.runtime.waypoints import Follower, Waypoint

if TYPE_CHECKING:
    from hobble.rows.clip_rows import ClipRows
    from hobble.runtime.retarget import RigDriver

# Largest x or z of a start position, cm (100 km). Farther from the origin, floats are imprecise.
FARTHEST = 1e7


class ProceduralAnimation:
    """One or many characters driven by one network.

        character = ProceduralAnimation.load("results/injured/network")
        pose = character.next_pose((0, 2.5), injury={"LeftUpLeg-LeftLeg": 7})

    Each call of `next_pose` moves all C characters. Each of its arguments is one value for all characters, or
    one value for each. The options are explained in `load`.
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
        variation: float = 0.0,
        seed: int = 0,
        axes: Axes | None = None,
        rig: Any = None,
        rig_joints: Mapping[str, str] | None = None,
        position: Any = None,
        facing: Any = None,
    ) -> None:
        if network.skeleton is None:
            joints = network.layout.joints
            raise ValueError(f"the network has no skeleton: pass skeleton=, one with {joints} joints")
        for name, value, least in (
            ("characters", characters, 1),
            ("steering", steering, 0),
            ("variation", variation, 0),
            *((f"the rate of {name}", value, 1e-9) for name, value in (rates or {}).items()),
            *((f"the scale of {name}", value, 1e-9) for name, value in (scales or {}).items()),
        ):
            if not least <= value < np.inf:
                bound = f"{least} or more" if least in (0, 1) else "more than 0"
                raise ValueError(f"{name} is {value!r}, but has to be {bound}, and finite")
        self.network, self.skeleton = network, network.skeleton
        self.characters = characters
        self.axes = self._pose_axes = axes or Axes()
        self._rig: RigDriver | None = None
        if rig is not None:
            from hobble.runtime.retarget import RigDriver, plan_rig  # only then: it reads files of clips

            self._rig = RigDriver(plan_rig(network.skeleton, rig, rig_joints))
            self.skeleton = self._rig.skeleton
            self.axes = replace(self.axes, size=self.axes.size * self._rig.scale)
        self._channel_values = ChannelValues(network, scales or {})
        self._limit_speed = limits
        self._variation, self._seeds = variation, seed + np.arange(characters)
        all_rates = {name: channel(name).rate for name in network.channels} | dict(rates or {})
        labels = [label for of_channel in network.channels.values() for label in of_channel]
        self._leg = leg_of_columns(network.skeleton, labels)
        self._controller_options = all_rates, foot_locking, steering
        self._predicted_by = (mode, storage)
        self.predictor = network.predictor(mode, storage)
        self._waypoints = list(waypoints) if waypoints is not None else None
        self._contacts = network.layout.y_contacts
        self._targets = CallerTargets(network.gaits, self.axes, characters)
        for waypoint in self._waypoints or ():
            self._targets.check_gait(waypoint.gait)
        self._terrain: tuple[Any, Any] = (None, None)  # the caller's last terrain, and its height function
        self.reset(position, facing)

    @classmethod
    def load(
        cls, path: str | Path, *, skeleton: Skeleton | str | Path | None = None, **options: Any
    ) -> ProceduralAnimation:
        """Load a network and put its characters at their start.

        path: weights.npz, the folder that holds it, or a folder with the .bin files of Holden et al. (2017).
        skeleton: a Skeleton or a file of config/skeletons, for a network file that has none.
        mode: how the weights are interpolated over the phase: "constant", "linear" or "cubic".
        storage: how weights are stored in memory, "float32" or "int16"; the default depends on the kind of
            network.
        characters: number of characters.
        waypoints: the track to follow when `next_pose` gets no velocity.
        rates: channel -> largest change of its values per second; default: the channel's own rate.
        scales: channel -> number by which its values are divided before the network gets them.
        foot_locking: whether a foot in contact with the ground is held where it landed.
        steering: how strongly the runtime corrects a velocity that differs from the target; 0: not at all, as
            in the runtime of Holden et al. (2017).
        limits: whether the target speed is limited to what a body with these channel values can reach.
        variation: how much steps differ from each other: 0 not at all, 1 as those of people do.
        seed: of this variation; character i has the seed `seed` + i. The same seed gives the same walk.
        axes: the caller's axes and unit, and the size of the character.
        rig: another rig that the character drives: a skeleton, or a file of config/skeletons or a BVH file
            whose zero pose stands. The pose then has the joints of this rig, which is `skeleton`. Velocities
            and ground are in the world of the rig.
        rig_joints: name of a rig's joint -> joint of the network's skeleton that it follows; by default they
            are matched. Other joints follow the joint above them.
        position, facing: see `reset`.

        Raises InputError for a file that is not a usable network, ValueError for an option out of range or if
        there is no skeleton, and UnknownName for a waypoint's gait that the network does not have.
        """
        return cls(load_network(path, skeleton), **options)

    def reset(self, position: Any = None, facing: Any = None) -> None:
        """Restart the characters, with all channels at their defaults.

        position: where they start, on the ground: (3,) or (C, 3), or without the height (2,) or (C, 2). By
        default this is the origin, or the start of the track of waypoints. facing: the direction that they
        face, with the same shapes. By default this is forward, or toward the first waypoint. Raises
        ValueError for a wrong shape, a number that is not finite, or a position more than 100 km from the
        origin.
        """
        count = self.characters
        self.follower = Follower(self._waypoints, count) if self._waypoints is not None else None
        place, yaw = self.follower.start if self.follower else (np.zeros(2), 0.0)
        places, yaws = np.tile(place, (count, 1)), np.full(count, yaw)
        if position is not None:
            places = self._targets.ground_vector("position", position)
        if np.abs(places).max() > FARTHEST:
            raise ValueError(f"position is further than {FARTHEST / 1e5:g} km from the origin: {position}")
        if facing is not None:
            ahead = self._targets.ground_vector("facing", facing)
            yaws = np.arctan2(ahead[:, 0], ahead[:, 1])
        self._continue_from(start_characters(self.network, count, places, yaws, self._channel_values.scales))

    def __copy__(self) -> ProceduralAnimation:
        return copy.deepcopy(self)

    def __deepcopy__(self, memo: dict[int, Any]) -> ProceduralAnimation:
        """A character that goes on from here by itself. The two share the network, but no state."""
        memo |= {id(shared): shared for shared in (self.network, self._rig)}
        out = object.__new__(ProceduralAnimation)
        out.__dict__.update(copy.deepcopy(self.__getstate__(), memo), _terrain=(None, None))
        out.predictor = self.predictor
        out._continue_from(out.state)
        return out

    def __getstate__(self) -> dict[str, Any]:
        """For pickle: all but the predictor and the controller, which are made anew. They hold no state."""
        made_anew = ("predictor", "_controller", "_limiter", "_terrain")
        return {name: value for name, value in self.__dict__.items() if name not in made_anew}

    def __setstate__(self, kept: dict[str, Any]) -> None:
        self.__dict__.update(kept, _terrain=(None, None))
        self.predictor = self.network.predictor(*self._predicted_by)
        self._continue_from(self.state)

    def _continue_from(self, state: Character) -> None:
        """Make a new controller, which continues from `state`."""
        self.state = state
        self._controller = Controller(self.predictor, state, self._controller_options)
        self._limiter = SpeedLimiter(self.network, self._channel_values.columns, self.characters)

    @cached_property
    def layers(self) -> Layers:
        """Functions that put other animation, such as a wave, on top of a pose."""
        return Layers(self.skeleton, self._pose_axes)

    def compare(self, rows: ClipRows) -> Compared:
        """Step through recorded rows: for each frame the captured pose, the predicted one and the error.

        rows: `hobble.rows.clip_rows.load_clip_rows("database/clips/<clip>.npz")`. The state of the characters
        stays as it is. Raises ValueError for rows of other joints or without the network's channels.
        """
        return compare(self, rows)

    @property
    def seconds(self) -> Array:
        """(6,) seconds of each step of the last frame: prepare, input, insert, predict, output, update."""
        return self._controller.seconds

    def next_pose(
        self,
        target_velocity: Any = None,
        facing: Any = None,
        gait: str | Sequence[str] | Array | None = None,
        *,
        terrain: Any = None,
        **channels: Mapping[str, Any] | Array | None,
    ) -> Pose:
        """Advance by one frame (1/60 s) and return the pose.

        target_velocity: distance per frame, in your axes and unit: (3,) or (C, 3), or without the height (2,)
            or (C, 2). None follows the waypoints; without waypoints the character stands.
        facing: direction to look in, same shapes, any length. None or zero: the direction of movement. While
            a character follows waypoints, their facing is used instead.
        gait: a name ("walk"), one name for each character, shares (6,) or (C, 6), or None to choose by speed.
            Below 0.1 cm a frame, a character stands instead of the named gait, or steps on the spot to turn;
            with "crouch" it stays down. Shares are always used as they are.
        terrain: None for flat ground at 0; a function of two ground coordinates (arrays) that returns
            heights; a `ground.Heightmap`; or a 2D array of heights around the origin. Coordinates and heights
            are in your axes and unit. Pass the same object in every frame, so that it is converted only once.
        channels: keywords named after channels, such as injury={"LeftUpLeg-LeftLeg": 7}. The value is a
            mapping from label (column of the channel) to value or (C,) values, or an array (L,) or (C, L) of
            all L labels. Labels that the mapping does not have go back to the default. None, or no keyword,
            leaves the channel unchanged. The values approach their targets at the channel's rate.

        Raises UnknownName (a KeyError) for a label or gait that the network does not have; TypeError for a
        keyword that is no channel; ValueError for a channel that the network has no input for, for values out
        of range (velocity above 18 m/s, gait share above 1, ground more than 100 km above or below 0), for
        values that are not finite, and for wrong shapes. After any error, also one in the terrain function,
        the characters are as they were before the call.
        """
        velocity, ahead, gait = self._choose_target(target_velocity, facing, gait)
        strafe, direction = np.empty(self.characters), np.empty((self.characters, 2))
        target_facing(velocity, ahead, self.state.smoothed_direction, strafe, direction)
        heading = self.state.direction[:, self.network.layout.window]
        shares = self._targets.gait_shares(velocity, direction, heading, gait)
        if terrain is not self._terrain[0]:
            self._terrain = (terrain, as_ground(terrain, self.axes))
        channel_targets = [
            self._channel_values.convert(name, given, self.characters)
            for name, given in channels.items()
            if given is not None
        ]
        controller = self._controller
        ground = self._terrain[1]
        arrays = (*vars(self.state).values(), controller.root, controller.yaw)
        before = [] if ground is None else [array.copy() for array in arrays]  # without ground nothing fails
        try:
            for columns, values in channel_targets:
                self.state.channel_targets[:, columns] = values
            if self._limit_speed:
                self._limiter.limit(self.state.channel_values, velocity, shares)
            controller.pace[:] = 1.0
            if self._variation:
                self._vary(velocity)
            if ground is not None and self._leg.any():
                self._time_steps(velocity, ground)
            controller.advance_frame((velocity, direction, strafe, shares), ground)
        except BaseException:
            for array, saved in zip(arrays, before, strict=False):
                array[...] = saved
            raise
        return self._pose()

    def _vary(self, velocity: Array) -> None:
        """Make each character's step differ, see `hobble.runtime.variation`. Changes `velocity` (C, 2)."""
        state, controller, columns = self.state, self._controller, self._channel_values.columns
        count_steps(state.step, state.phase)
        slowing = [(columns[name], channel(name)) for name in columns if channel(name).slows]
        shares = [state.channel_values[:, at].max(axis=1, initial=0.0) / each.highest for at, each in slowing]
        hurt = np.minimum(np.max([np.zeros(self.characters), *shares], axis=0), 1.0)
        pace, speed, shown, swing = vary_step(self._seeds, state.step, hurt, self._variation)
        mix_swing((state.knee_more, state.arm_more), state.step, swing)
        controller.pace[:], controller.shown[:] = pace, shown
        velocity *= speed[:, None]

    def _time_steps(self, velocity: Array, ground: Any) -> None:
        """Let the right leg go first on stairs, see `hobble.runtime.stairs`. Changes `velocity` (C, 2)."""
        state, now = self.state, self.network.layout.window
        join = joins(state.channel_values, self._leg)
        if join.any():
            place, before = state.position[:, now], state.position[:, now - now // 2]
            speed = np.linalg.norm(place - before, axis=1) / (now // 2)
            heights = partial(heights_at, ground)
            pace, slower = time_steps(heights, place, velocity, speed, state.phase, join)
            self._controller.pace *= pace
            velocity *= slower[:, None]

    def _choose_target(self, velocity: Any, facing: Any, gait: Any) -> tuple[Array, Array, Any]:
        """Target velocity (C, 2), facing (C, 2) and gait, from the caller or the waypoints.

        A facing of zero means the direction of movement. The gait is in a form that `gait_shares` of
        `CallerTargets` takes.
        """
        still = np.zeros((self.characters, 2))
        ahead = still if facing is None else self._targets.ground_vector("facing", facing)
        if velocity is not None:
            return self._targets.velocity(velocity), ahead, gait
        if self.follower is None:
            return still.copy(), ahead, gait
        target, ahead, gaits = self.follower.lead(self.state.position[:, self.network.layout.window])
        return target, ahead, gaits if gait is None else gait

    def _pose(self) -> Pose:
        """The pose after the last frame, as copies in the caller's axes and unit."""
        controller, state = self._controller, self.state
        contacts = np.minimum(np.maximum(controller.y[:, self._contacts], 0), 1)
        channels = {
            name: state.channel_values[:, columns].copy()
            for name, columns in self._channel_values.columns.items()
        }
        root, yaw, positions, rotations = (array.copy() for array in controller.drawn)
        phase = state.phase.copy()
        pose = self.pose_in_callers_axes(positions, rotations, contacts, phase, root, yaw, channels)
        return pose if self.characters > 1 else pose[0]

    def pose_in_callers_axes(
        self, positions: Array, rotations: Array, contacts: Array, phase: Array, root: Array, yaw: Array,
        channels: Mapping[str, Array],
    ) -> Pose:  # fmt: skip
        """C poses of the network's joints in Hobble's axes as those that the caller gets, see `Pose`."""
        if self._rig is not None:
            positions, rotations = self._rig(positions, rotations)
        if not self._pose_axes.is_native:
            positions = self._pose_axes.points_to_caller(positions)
            rotations = self._pose_axes.rotations_to_caller(rotations)
        if not self.axes.is_native:
            root = self.axes.points_to_caller(root)
        return Pose(positions, rotations, contacts, phase, root, yaw, channels)
