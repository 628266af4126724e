"""Measures that papers of the field publish, of the character and of captured motion. See `field`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.channels import channel
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, local_rotations
from hobble.measures.measure import MeasureInputs, Outcome
from hobble.measures.motion_quality import FPS, cleanness, compare_windows, window_features
from hobble.measures.sample import HURT_VERSION, ClipPart, clip_parts
from hobble.measures.walks import in_world, record
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.clip_rows import captured_stretches, headings, rotate_by_yaw
from hobble.runtime import Runtime
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.caller_targets import Pose, world_rotations

if TYPE_CHECKING:
    from hobble.measures.field import Options

WALK, JOG = 2.0, 7.0  # cm a frame: 1.2 and 4.2 m/s
LOOK_AHEAD = 20  # frames: the character is asked to go where the path will be after these
SETTLING = 90  # frames at the start of a walk that are not measured
REACHED = 0.8  # the asked gait counts as reached at this share of the asked speed
LONGEST_RESPONSE = 4 * FPS
LONGEST, SHORTEST = 20 * FPS, 3 * FPS  # frames of a captured stretch that is walked again
MOST_STRETCHES = 60


# F frames of a body: positions (F, J, 3), cm, in the world, and rotations (F, J, 4), relative to the parent.
Motion = tuple[Array, Array]


@dataclass(frozen=True)
class Command:
    """What a captured person did in F frames, as a command: velocity (F, 2) x and z in the world, cm a frame,
    gait (F, 6) shares, ahead (F, 2) facing direction; and the captured motion.
    """

    velocity: Array = field(repr=False)
    gait: Array = field(repr=False)
    ahead: Array = field(repr=False)
    motion: Motion = field(repr=False)

    def __len__(self) -> int:
        return len(self.velocity)


def paths() -> dict[str, Array]:
    """Closed paths (N, 2), a point for each cm: a circle (radius 250 cm), a square and a star like it."""
    angle = np.linspace(0.0, 2 * np.pi, 1571)[:-1]
    corners = 250.0 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
    tips = np.pi * (0.5 + 0.8 * np.arange(5))  # every second of five points of a circle: a pentagram
    star = 250.0 * np.column_stack([np.cos(tips), np.sin(tips)])
    return {
        "circle": 250.0 * np.column_stack([np.cos(angle), np.sin(angle)]),
        "square": _polygon(corners),
        "star": _polygon(star),
    }


def _polygon(corners: Array) -> Array:
    """The closed line through corners (K, 2), a point for each cm."""
    sides = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = round(float(np.hypot(*(end - start))))
        sides.append(start + np.linspace(0.0, 1.0, count, endpoint=False)[:, None] * (end - start))
    return np.concatenate(sides)


def follow_path(network: Network, runtime: Runtime, path: Array) -> dict[str, float]:
    """Mean distance (cm) and angle (degrees) between the asked and the walked path.

    Each frame, the character at WALK speed is asked to go to the point that the path reaches after LOOK_AHEAD
    frames. Of one and a half laps, the first half is not measured. path: (N, 2), a point for each cm.
    """
    start, ahead = path[0], path[5] - path[0]
    animation = ProceduralAnimation(network, position=start, facing=ahead, **dict(runtime))
    at, passed, place = 0, 0, start
    distances, angles = [], []
    for _ in range(int(1.5 * len(path) / WALK * 3)):  # at a third of the speed it gives up
        way = path[(at + round(LOOK_AHEAD * WALK)) % len(path)] - place
        pose = animation.next_pose(way / max(float(np.hypot(*way)), 1e-6) * WALK, gait="walk")
        before, place = place, pose.root[::2].copy()
        # The nearest point of the path not far ahead: crossing branches of a star are not mixed up.
        near = (at + np.arange(-20, 60)) % len(path)
        step = int(np.argmin(np.hypot(*(path[near] - place).T))) - 20
        at, passed = (at + step) % len(path), passed + step
        if passed > len(path) // 2:
            distances.append(float(np.hypot(*(path[at] - place))))
            (a, b), (c, d) = place - before, path[(at + 1) % len(path)] - path[at]
            angles.append(np.degrees(abs(np.arctan2(a * d - b * c, a * c + b * d))))
        if passed >= 1.5 * len(path):
            break
    return {"cm": round(float(np.mean(distances)), 3), "degrees": round(float(np.mean(angles)), 3)}


def response(network: Network, runtime: Runtime, gait: str, speed: float) -> float | None:
    """Seconds from the command to a standing character until its mean speed over a quarter of a second is
    REACHED times `speed`; None if it does not come to that in LONGEST_RESPONSE.
    """
    animation = ProceduralAnimation(network, **dict(runtime))
    for _ in range(2 * FPS):
        animation.next_pose((0.0, 0.0))
    places = [np.asarray(animation.next_pose((0.0, 0.0)).root)]
    for frame in range(LONGEST_RESPONSE):
        places.append(np.asarray(animation.next_pose((0.0, speed), gait=gait).root))
        since = places[max(0, len(places) - 1 - FPS // 4)]  # before the command it stood still
        if np.hypot(*(places[-1] - since)[::2]) / (FPS // 4) >= REACHED * speed:
            return round((frame + 1) / FPS, 3)
    return None


def straight_walk(network: Network, runtime: Runtime, seconds: float) -> Motion:
    """A straight walk at WALK speed, after SETTLING."""
    gait = [float(name == "walk") for name in network.gaits]
    target = {"target_velocity": [0.0, WALK], "gait": gait}
    frames = SETTLING + round(seconds * FPS)
    positions, rotations = walk(network, runtime, [target] * frames, 1)[0]
    return positions[SETTLING:], rotations[SETTLING:]


def walk_commands(network: Network, runtime: Runtime, commands: Sequence[Command]) -> list[Motion]:
    """The character's motion for each command, all as one crowd."""
    longest = max(map(len, commands))

    def of_all(name: str) -> Array:
        """(F, C, ...); the last value of a shorter command is repeated."""
        each = [getattr(command, name) for command in commands]
        return np.stack([np.pad(v, ((0, longest - len(v)), (0, 0)), "edge") for v in each], axis=1)

    asked = zip(*map(of_all, ("velocity", "gait", "ahead")), strict=True)
    targets = [{"target_velocity": v, "gait": gait, "facing": ahead} for v, gait, ahead in asked]
    walked = walk(network, runtime, targets, len(commands))
    return [(p[: len(c)], r[: len(c)]) for (p, r), c in zip(walked, commands, strict=True)]


def walk(
    network: Network, runtime: Runtime, targets: Iterable[Mapping[str, Any]], count: int
) -> list[Motion]:
    """The motion of `count` characters, who start standing. targets: see `walks.record`."""
    assert network.skeleton is not None
    joints = len(network.skeleton.joints)

    def kept(pose: Pose) -> tuple[Array, ...]:
        shaped = pose.positions.reshape(count, joints, 3), pose.rotations.reshape(count, joints, 4)
        return tuple(values.astype(np.float32) for values in shaped)

    positions, rotations = record(network, runtime, targets, kept, count)
    local = local_rotations(network.skeleton, rotations)
    return [(positions[:, i], local[:, i]) for i in range(count)]


def commands_of_clips(inputs: MeasureInputs, skeleton: Skeleton, split: str) -> list[Command]:
    """Healthy captured stretches of a split as commands, at most MOST_STRETCHES."""
    clips = {
        clip: path
        for clip, path in inputs.clips.items()
        if inputs.splits[clip] == split and not HURT_VERSION.search(clip) and not clip.endswith("_mirror")
    }
    found: list[Command] = []
    for part in clip_parts(clips, None):
        found += _commands_of(part, skeleton)
        if len(found) >= MOST_STRETCHES:
            break
    return found[:MOST_STRETCHES]


def _commands_of(part: ClipPart, skeleton: Skeleton) -> Iterator[Command]:
    """The stretches of one clip in which nothing hurts, each of SHORTEST to LONGEST frames."""
    rows = part.load().rows
    layout = rows.layout
    for captured in captured_stretches(rows):
        # Guarding, whose default is not 0, shows in a hurt body only.
        told = [values for name, values in captured.channels.items() if channel(name).default == 0]
        if any(map(np.any, told)):
            continue
        yaw = headings(rows.y[captured.rows][:, layout.y_turn][:, 0].astype(float))
        turns = rows.y[captured.rows][:, layout.y_joint_rotation].reshape(len(captured), -1, 3)
        positions = in_world(captured.local, captured.root, yaw)
        rotations = local_rotations(skeleton, world_rotations(turns, yaw))
        ahead = np.column_stack([np.sin(yaw), np.cos(yaw)])
        velocity = rotate_by_yaw(captured.velocity, yaw)
        for first in range(0, len(captured) - SHORTEST + 1, LONGEST):
            frames = slice(first, first + LONGEST)
            if len(velocity[frames]) >= SHORTEST:
                motion = positions[frames], rotations[frames]
                yield Command(velocity[frames], captured.gait[frames], ahead[frames], motion)


def mean_cleanness(skeleton: Skeleton, motions: Sequence[Motion]) -> dict[str, float]:
    """Skating, rotation of joints, jerk and contact speed of motions: means over them."""
    found = [cleanness(skeleton, *motion) for motion in motions]
    return {key: round(float(np.nanmean([one[key] for one in found])), 4) for key in found[0]}


def compare_with_captured(
    network: Network, runtime: Runtime, commands: Sequence[Command]
) -> dict[str, dict[str, Any]]:
    """The character asked for what captured people did, beside these people.

    Of both, the first SETTLING frames of each stretch are left out, since the character starts standing. The
    Frechet distance of `captured` is that of two halves of its stretches, in turn.
    """
    skeleton = network.skeleton
    assert skeleton is not None
    captured, walked = (
        [(positions[SETTLING:], rotations[SETTLING:]) for positions, rotations in motions]
        for motions in ([c.motion for c in commands], walk_commands(network, runtime, commands))
    )
    mine, theirs = (
        [window_features(skeleton, positions) for positions, _ in motions] for motions in (walked, captured)
    )
    half = np.repeat(np.arange(len(theirs)) % 2 == 0, list(map(len, theirs)))
    windows = compare_windows(np.concatenate(mine), np.concatenate(theirs), half)
    return {
        who: mean_cleanness(skeleton, motions)
        | {key: None if np.isnan(value) else round(value, 4) for key, value in found.items()}
        for who, motions, found in zip(("character", "captured"), (walked, captured), windows, strict=True)
    }


def measure_field(
    network: Network, runtime: Runtime, options: Options, commands: Mapping[str, Sequence[Command]]
) -> dict[str, Any]:
    """The content of field.json (docs/artefacts.md). commands: split -> its captured stretches."""
    assert network.skeleton is not None
    split = next((name for name in ("held_out", "train") if commands.get(name)), None)
    straight = straight_walk(network, runtime, options.field_seconds)
    return {
        "paths": {name: follow_path(network, runtime, path) for name, path in paths().items()},
        "response": {
            "walk": response(network, runtime, "walk", WALK),
            "jog": response(network, runtime, "jog", JOG),
        },
        "straight": mean_cleanness(network.skeleton, [straight]),
        "split": split,
        "stretches": len(commands[split]) if split else 0,
        "asked": compare_with_captured(network, runtime, commands[split]) if split else None,
    }


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """field.json, and its values as a table."""
    network = load_network(inputs.weights)
    assert network.skeleton is not None
    commands = {split: commands_of_clips(inputs, network.skeleton, split) for split in ("held_out", "train")}
    result = measure_field(network, inputs.runtime, options, commands)
    circle, skated = result["paths"]["circle"]["cm"], result["straight"]["skating"]
    return Outcome(result, {}, f"off a circle by {circle:.1f} cm; feet skate {skated:.3f} cm a frame")
