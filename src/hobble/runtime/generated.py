"""Motion that the character makes for files: scripted scenarios, loops of its gaits, as npz, BVH and glTF.

In some scenarios the value of a channel's column is swept: it rises from 0 to the highest. A channel is a
group of network inputs that tell, for example, how hurt each part of the body is. Loops are walks that can be
repeated without a jump: they are cut out of a longer walk straight on, with the ends blended.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from hobble.channels import channel
from hobble.channels.shown import channel_display
from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.files import save_npz
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, forward_kinematics, local_rotations, two_bone_knee
from hobble.figure.gltf import BodyMotion, write_glb
from hobble.models.network import Network
from hobble.runtime import Runtime
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.leg import leg_joints

FPS = 60.0  # frames a second of the generated motion
SETTLED = 6 * 60  # frames until the gait has settled; no loop begins earlier
LENGTHS = (150, 300)  # frames: least and greatest length of a loop, unless the caller says otherwise
BLEND = 12  # frames over which the end of a loop is blended into its start
SPEEDS = {"stand": 0.0, "walk": 2.5, "jog": 7.0, "crouch": 2.0}  # cm a frame, of the gaits that can repeat
LOOP_FRAMES = (40, 150)  # frames at 60 Hz: least and greatest length of a loop in a glTF file
HURT = 0.7  # share of a channel's highest value, with which the hurt loops walk

Values = Mapping[str, Mapping[str, float]]  # channel -> column -> value


@dataclass(frozen=True)
class Scenario:
    """A script of `frames` frames at 60 Hz.

    target: function from the frame's number to the velocity (2,), cm a frame, the facing (2,), or None to
    look where the character goes, and the gait. swept: channel and column of the value that rises from 0 to
    the channel's highest during the script; None: all values are 0.
    """

    name: str
    frames: int
    target: Callable[[int], tuple[Array, Array | None, str]] = field(repr=False)
    swept: tuple[str, str] | None = None


def _vector(length: float, degrees: float = 0.0) -> Array:
    """(2,) x and z of a velocity or facing. degrees: from +Z toward +X (left)."""
    return length * np.array([np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])


def scenarios(network: Network) -> list[Scenario]:
    """The seven scenarios for every network, and a walk for each column that `swept_columns` lists."""
    facing = _vector(1.0)
    out = [
        # Five seconds straight ahead, then a curve of half a degree a frame.
        Scenario("walk", 900, lambda f: (_vector(2.5, max(0, f - 300) * 0.5), None, "walk")),
        Scenario("jog", 900, lambda f: (_vector(7.0, max(0, f - 300) * 0.5), None, "jog")),
        Scenario("crouch", 600, lambda f: (_vector(2.0), None, "crouch")),
        Scenario("strafe", 600, lambda f: (_vector(2.5, 90 if f % 300 < 150 else -90), facing, "walk")),
        Scenario("backward", 480, lambda f: (_vector(2.0, 180), facing, "walk")),
        Scenario("stop_and_go", 720, lambda f: (_vector(2.5 if f % 240 < 150 else 0.0), None, "walk")),
        Scenario("turn_in_place", 600, lambda f: (_vector(0.0), _vector(1.0, 90 * (f // 120)), "walk")),
    ]
    for name, column in swept_columns(network).items():
        out.append(Scenario(name, 720, lambda f: (_vector(2.5), None, "walk"), column))
    return out


def swept_columns(network: Network) -> dict[str, tuple[str, str]]:
    """The scenarios with a swept value: name -> channel and column. Empty without channels."""
    skeleton = network.skeleton
    assert skeleton is not None
    return {
        name: (of_channel, column)
        for of_channel, columns in network.channels.items()
        for name, column in channel_display(
            of_channel, skeleton, columns, network.trained_labels(of_channel)
        ).sweeps.items()
    }


def run_scenario(network: Network, scenario: Scenario, options: Runtime) -> dict[str, np.ndarray]:
    """Generate one scenario of F frames on flat ground.

    Returns positions (F, J, 3), world, cm; rotations (F, J, 4), world; contacts (F, 4) from 0 to 1, of left
    heel, left toe, right heel and right toe; phase (F,), cycles; root (F, 3) on the ground, cm; target (F, 2)
    velocity, cm a frame; swept_values (F,) of the swept column, 0 if there is none; gait (F,) names of the
    target gaits.
    """
    animation, poses = ProceduralAnimation(network, **dict(options)), []
    values = np.zeros(scenario.frames, np.float32)
    targets = [scenario.target(f) for f in range(scenario.frames)]
    for f, (velocity, facing, gait) in enumerate(targets):
        channels = {}
        if scenario.swept:
            name, column = scenario.swept
            values[f] = channel(name).highest * f / max(1, scenario.frames - 1)
            channels = {name: {column: float(values[f])}}
        poses.append(animation.next_pose(velocity, facing, gait, **channels))
    of_poses = ("positions", "rotations", "contacts", "phase", "root")
    return {
        **{key: np.array([getattr(pose, key) for pose in poses]) for key in of_poses},
        "target": np.array([velocity for velocity, _, _ in targets]),
        "swept_values": values,
        "gait": np.array([gait for _, _, gait in targets]),
    }


def write_motions(
    network: Network, bvh: str | Path, options: Runtime
) -> Iterator[tuple[Scenario, dict[str, np.ndarray]]]:
    """Run every scenario, write each as a BVH file into the folder `bvh`, and yield its motion."""
    for scenario in scenarios(network):
        motion = run_scenario(network, scenario, options)
        at = motion["positions"], motion["rotations"]
        export_bvh(Path(bvh) / f"{scenario.name}.bvh", scenario.name, skeleton_in_motion(network, *at), *at)
        yield scenario, motion


def generate_scenarios(network: Network, npz: str | Path, bvh: str | Path, options: Runtime) -> None:
    """Run every scenario; write all of them to the file `npz`, and each to a BVH file in the folder `bvh`.

    The file has names (N,) of the scenarios, joints (J,) names, parents (J,) and fps. For each scenario it
    has <name>/<key> for the keys of `run_scenario`, numbers as float32, and <name>/swept (2,), channel and
    column, both "" if nothing is swept.
    """
    assert network.skeleton is not None
    arrays: dict[str, np.ndarray] = {}
    names = []
    for scenario, motion in write_motions(network, bvh, options):
        names.append(scenario.name)
        for key, values in motion.items():
            arrays[f"{scenario.name}/{key}"] = values if key == "gait" else values.astype(np.float32)
        arrays[f"{scenario.name}/swept"] = np.array(scenario.swept or ("", ""))
    skeleton = network.skeleton
    facts = {"names": names, "joints": skeleton.joints, "parents": skeleton.parents, "fps": FPS}
    save_npz(npz, **{key: np.array(value) for key, value in facts.items()}, **arrays)


@dataclass(frozen=True)
class RepeatedWalk:
    """A walk that can be repeated: after its last frame, its first frame follows without a jump.

    positions: (F, J, 3), cm. rotations: (F, J, 4). travel: (3,) cm from the start of one repetition to the
    start of the next. gap: mean distance by which the joints would jump without blending, cm.
    """

    positions: Array
    rotations: Array
    travel: Array
    gap: float

    def ahead(self) -> RepeatedWalk:
        """The same walk, starting above the origin and going along +z on average."""
        yaw = np.arctan2(self.travel[0], self.travel[2]) if np.linalg.norm(self.travel) > 1.0 else 0.0
        back = quat.yaw(-yaw)
        count = len(self.positions)
        # The mean distance of the root from a point that moves at constant speed.
        even = np.arange(count)[:, None] / count * self.travel
        start = (self.positions[:, 0] - even).mean(axis=0) * [1.0, 0.0, 1.0]
        return replace(
            self,
            positions=quat.rotate(back, self.positions - start),
            rotations=quat.mul(back, self.rotations),
            travel=quat.rotate(back, self.travel),
        )


def make_loop(
    network: Network, values: Values, runtime: Runtime, gait: str = "walk", lengths: tuple[int, int] = LENGTHS
) -> RepeatedWalk:
    """A loop of the character going straight on, cut out of a longer walk by `find_cut`.

    values: channel -> column -> value. gait: of SPEEDS. lengths: the least and the greatest, frames.
    """
    animation = ProceduralAnimation(network, **dict(runtime))
    target = np.array([0.0, SPEEDS[gait]])
    count = SETTLED + 60 + lengths[1] + BLEND
    poses = [animation.next_pose(target, None, gait, **values) for _ in range(count)]
    positions, rotations = np.array([p.positions for p in poses]), np.array([p.rotations for p in poses])
    first, stop, gap = find_cut(positions, lengths)
    loop_positions, loop_rotations = positions[first:stop].copy(), rotations[first:stop].copy()
    travel = positions[stop, 0] - positions[first, 0]
    travel[1] = 0.0
    # The end of the loop is blended into the frames just before its first frame, moved on by `travel`.
    for k in range(BLEND):
        share = (k + 1) / (BLEND + 1)
        here, before = stop - BLEND + k, first - BLEND + k
        loop_positions[here - first] = (1 - share) * positions[here] + share * (positions[before] + travel)
        loop_rotations[here - first] = _mix_rotations(rotations[here], rotations[before], share)
    return RepeatedWalk(loop_positions, loop_rotations, travel, gap)


def find_cut(positions: Array, lengths: tuple[int, int] = LENGTHS) -> tuple[int, int, float]:
    """Find two frames of a walk, (F, J, 3), between which it can be cut out and repeated.

    Their poses and velocities are as similar as possible. Returns the first frame of the loop, the frame
    after its last, and the mean distance (cm) between the joints in these two frames. First frames within a
    second after SETTLED and all allowed lengths are tried.
    """
    local = positions - positions[:, :1] * np.array([1.0, 0.0, 1.0])  # the root stays over the origin
    velocity = np.gradient(local, axis=0)
    best = (SETTLED, SETTLED + lengths[0], np.inf)
    for first in range(SETTLED, SETTLED + 60, 2):
        later = np.arange(first + lengths[0], min(first + lengths[1], len(positions) - BLEND))
        # Distance of the poses, cm, plus 3 times the difference of the velocities, cm a frame.
        difference = np.linalg.norm(local[later] - local[first], axis=-1).mean(axis=1)
        difference += 3 * np.linalg.norm(velocity[later] - velocity[first], axis=-1).mean(axis=1)
        if difference.min() < best[2]:
            best = (first, int(later[difference.argmin()]), float(difference.min()))
    first, stop, _ = best
    return first, stop, float(np.linalg.norm(local[stop] - local[first], axis=-1).mean())


def _mix_rotations(a: Array, b: Array, share: float) -> Array:
    """Rotations (J, 4) between a and b. share: 0 gives a, 1 gives b."""
    b = np.where((a * b).sum(-1, keepdims=True) < 0, -b, b)  # q and -q are the same rotation
    mixed = (1 - share) * a + share * b
    return mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)


def export_bvh(path: str | Path, name: str, skeleton: Skeleton, positions: Array, rotations: Array) -> None:
    """Write world positions (F, J, 3) and rotations (F, J, 4), Hobble's axes, as a 60 Hz BVH file in cm.

    A file has the rotations of all joints, but only the root's position. Predicted rotations do not quite
    lead to the predicted positions. Feet that are off by some millimetres would seem to slide. So the legs
    are bent as by `restore_bone_lengths`.
    """
    world, places = restore_bone_lengths(skeleton, positions, rotations)
    local = quat.continuous(local_rotations(skeleton, world))
    write_bvh(path, Clip(name, skeleton, FPS, local, places[:, 0]))


def restore_bone_lengths(skeleton: Skeleton, positions: Array, rotations: Array) -> tuple[Array, Array]:
    """World rotations (F, J, 4) and positions (F, J, 3) of the skeleton in a predicted motion.

    Its bones keep their lengths, while those of a predicted pose change. positions (F, J, 3), rotations
    (F, J, 4): predicted, in the world. The root gets its predicted position, and all joints their predicted
    rotations. Then the legs are bent so that the toes reach their predicted positions.
    """
    local = local_rotations(skeleton, np.asarray(rotations, float))
    world, reached = forward_kinematics(skeleton, local, np.asarray(positions[:, 0], float))
    for leg in leg_joints(skeleton):
        heel, toe = leg[2], leg[3]
        # The foot keeps its rotation, so the heel has to move as far as the toe.
        _bend_leg(world, reached, leg, positions[:, toe] - reached[:, toe] + reached[:, heel])
    local = local_rotations(skeleton, world)
    return forward_kinematics(skeleton, local, np.asarray(positions[:, 0], float))


def _bend_leg(world: Array, positions: Array, leg: Array, target: Array) -> None:
    """Turn thigh and shank so that the heel reaches target (F, 3). The foot's rotation stays.

    world: (F, J, 4) world rotations, changed in place. positions: (F, J, 3) before the turn, not changed.
    leg: hip, knee, heel and toe joint.
    """
    hip, knee, heel = leg[:3]
    thigh, shank = positions[:, knee] - positions[:, hip], positions[:, heel] - positions[:, knee]
    thigh_length, shank_length = (float(np.linalg.norm(bone, axis=-1).mean()) for bone in (thigh, shank))
    new_knee, new_heel = two_bone_knee(positions[:, hip], target, thigh, thigh_length, shank_length)
    world[:, hip] = quat.mul(quat.between(thigh, new_knee - positions[:, hip]), world[:, hip])
    world[:, knee] = quat.mul(quat.between(shank, new_heel - new_knee), world[:, knee])


def skeleton_in_motion(network: Network, positions: Array, rotations: Array) -> Skeleton:
    """The skeleton of a network in its motion: positions (F, J, 3), rotations (F, J, 4), in the world.

    A network's file without a skeleton was trained on another body than the skeleton that the caller gave. So
    each joint gets its mean offset from its parent in the motion.
    """
    skeleton = network.skeleton
    assert skeleton is not None
    if "skeleton" in network.meta:
        return skeleton
    offsets = np.zeros((len(skeleton.joints), 3))
    for j, p in enumerate(skeleton.parents):
        if p >= 0:
            offset = quat.rotate(quat.inv(rotations[:, p]), positions[:, j] - positions[:, p])
            offsets[j] = offset.mean(axis=0)
    return replace(skeleton, offsets=offsets)


def export_glb(path: str | Path, network: Network, runtime: Runtime) -> None:
    """Write the body of a network's skeleton as the file `path`, with loops of each gait.

    Raises HobbleError for a network without a skeleton.
    """
    if network.skeleton is None:
        raise HobbleError(f"cannot write {path}: the network's file has no skeleton, so there is no body")
    write_glb(path, network.skeleton, list(_loops(network, network.skeleton, runtime)))


def _loops(network: Network, skeleton: Skeleton, runtime: Runtime) -> Iterator[BodyMotion]:
    """Each gait as a loop, healthy and with each swept value, in place and with the root moving."""
    hurt = {
        f"_{name}": {of_channel: {column: HURT * channel(of_channel).highest}}
        for name, (of_channel, column) in swept_columns(network).items()
    }
    for gait in SPEEDS:
        for name, values in {"": {}, **hurt}.items():
            loop = make_loop(network, values, runtime, gait, LOOP_FRAMES).ahead()
            # Its first pose comes once more at its end.
            positions = np.concatenate([loop.positions, loop.positions[:1] + loop.travel])
            rotations = np.concatenate([loop.rotations, loop.rotations[:1]])
            moving = np.arange(len(positions))[:, None] / len(loop.positions) * loop.travel
            world, places = restore_bone_lengths(skeleton, positions, rotations)
            local = local_rotations(skeleton, world)
            yield BodyMotion(f"{gait}{name}_loop", places[:, 0] - moving, local, FPS)
            yield BodyMotion(f"{gait}{name}_loop_root_motion", places[:, 0], local, FPS, moving)
