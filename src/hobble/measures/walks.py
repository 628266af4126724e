"""Walks of generated figures, and what is measured of a walk.

Centimetres, degrees, 60 frames a second. F is the number of frames, J that of joints. contacts: (F, 4)
predicted contacts with the ground, from 0 to 1, of left heel, left toe, right heel, right toe.
"""

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.core.smooth import true_runs
from hobble.models.network import Network
from hobble.rows.clip_rows import rotate_by_yaw
from hobble.runtime import Runtime
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.caller_targets import Pose

STANCE = 0.5  # a foot counts as standing if its predicted contact is at least this
SHORTEST_STANCE = 4  # frames; a shorter contact is neither a stance nor a step


def feet_in_stance(contacts: Array) -> np.ndarray:
    """(F, 2) whether the left and the right foot stand, on heel or toe or both. contacts: (F, 4)."""
    return np.maximum(contacts[:, ::2], contacts[:, 1::2]) >= STANCE


def largest_turn(rotations: Array) -> float:
    """Largest rotation of any joint from one frame to the next, degrees.

    rotations: (F, J, 4) quaternions of the joints in the world.
    """
    # Two rotations whose quaternions have the dot product d differ by an angle of 2 arccos |d|.
    dot = np.abs(np.sum(rotations[1:] * rotations[:-1], axis=-1, dtype=float))
    return float(np.degrees(2 * np.arccos(dot.min(initial=1.0))))


def acceleration(positions: Array) -> Array:
    """(F - 2, ...) length of the second difference of positions (F, ..., 3), cm per frame squared."""
    return np.linalg.norm(np.diff(positions, n=2, axis=0), axis=-1)


def bend(a: Array, b: Array, c: Array) -> Array:
    """(...) degrees by which a limb is bent at b; 0 is straight.

    a, b, c: (..., 3) positions of three successive joints of the limb.
    """
    u, v = b - a, c - b
    cosine = np.sum(u * v, axis=-1) / np.maximum(
        np.linalg.norm(u, axis=-1) * np.linalg.norm(v, axis=-1), 1e-9
    )
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def in_root_coordinates(positions: Array, root: Array, yaw: Array) -> Array:
    """Convert world positions (..., J, 3) to coordinates of a root at `root` (..., 3) with `yaw` (...)."""
    p = positions - root[..., None, :]
    sin, cos = np.sin(yaw)[..., None], np.cos(yaw)[..., None]
    x, z = p[..., 0] * cos - p[..., 2] * sin, p[..., 0] * sin + p[..., 2] * cos
    return np.stack([x, p[..., 1], z], axis=-1)


def in_world(local: Array, root: Array, yaw: Array) -> Array:
    """The inverse of `in_root_coordinates`, in float64."""
    world = local.astype(float)
    world[..., ::2] = rotate_by_yaw(world[..., ::2], np.asarray(yaw)[..., None])
    return world + root[..., None, :]


def asymmetry(left: float | None, right: float | None) -> float | None:
    """(left - right) / mean of both: positive if the left is larger. None if one is None or both are 0."""
    if left is None or right is None or left + right == 0:
        return None
    return 2 * (left - right) / (left + right)


def gait_measures(
    skeleton: Skeleton, local: Array, contacts: Array, travelled: Array
) -> dict[str, float | None]:
    """Measures of one character's walk: name -> value.

    local: (F, J, 3) joint positions in root coordinates, cm. contacts: (F, 4). travelled: (F, 3) positions of
    the root in the world, cm.

    `speed`: cm/s, from the straight distance between the first and last root. `stance_left`: share of the
    frames in which the foot stands. `step_left`: mean step length, cm, that is how far the landing heel is
    ahead of the other heel; None if there is no step. `knee_left`, `arm_left`: range of the knee's bend and
    of the arm's swing, degrees from the 5th to the 95th percentile. The right side has the same measures.
    `stance_asymmetry`, `step_asymmetry`: see `asymmetry`. `lean_forward`, `lean_left`: mean lean of the
    trunk, degrees. `hip_height`: mean height of the hips, cm.
    """
    role = skeleton.role
    seconds = (len(local) - 1) / 60
    standing = feet_in_stance(contacts)
    heels = local[:, [role("left_heel"), role("right_heel")], 2]  # how far forward
    steps: list[list[float]] = [[], []]  # lengths of the left foot's steps, then of the right foot's
    for side in range(2):
        for start, end in true_runs(standing[:, side]):
            if start > 0 and end - start >= SHORTEST_STANCE:  # a stance from frame 0 has no landing
                steps[side].append(heels[start, side] - heels[start, 1 - side])
    step_lengths = [float(np.mean(lengths)) if lengths else None for lengths in steps]
    stance_shares = [float(share) for share in standing.mean(axis=0)]
    out: dict[str, Any] = {
        "speed": float(np.linalg.norm((travelled[-1] - travelled[0])[::2]) / seconds),
        "stance_left": stance_shares[0],
        "stance_right": stance_shares[1],
        "stance_asymmetry": asymmetry(*stance_shares),
        "step_left": step_lengths[0],
        "step_right": step_lengths[1],
        "step_asymmetry": asymmetry(*step_lengths),
    }
    for name in ("left", "right"):
        hip, knee, heel = (local[:, role(f"{name}_{part}")] for part in ("hip", "knee", "heel"))
        arm = local[:, role(f"{name}_wrist")] - local[:, role(f"{name}_shoulder")]
        out[f"knee_{name}"] = float(np.ptp(np.percentile(bend(hip, knee, heel), [5, 95])))
        swing = np.degrees(np.arctan2(arm[:, 2], -arm[:, 1]))
        out[f"arm_{name}"] = float(np.ptp(np.percentile(swing, [5, 95])))
    trunk = (local[:, role("neck")] - local[:, role("hips")]).mean(axis=0)
    out["lean_forward"] = float(np.degrees(np.arctan2(trunk[2], trunk[1])))
    out["lean_left"] = float(np.degrees(np.arctan2(trunk[0], trunk[1])))
    out["hip_height"] = float(local[:, role("hips"), 1].mean())
    return out


FPS = 60
SPEEDS = {"walk": 2.5, "jog": 7.0}  # target speeds, cm a frame
# This share of a stretch, at its start, is not measured, because the motion still changes to the new target.
SETTLING_SHARE = 0.25
PHASES = 24  # phase bins of a cycle
Case = Mapping[str, Mapping[str, float]]  # channel -> column -> value of a figure; other columns are 0


def record(
    network: Network,
    runtime: Runtime,
    targets: Iterable[Mapping[str, Any]],
    kept: Callable[[Pose], tuple[Array, ...]],
    characters: int = 1,
) -> list[Array]:
    """Let characters, who begin standing, follow targets, and keep arrays of their poses.

    targets: the arguments of `next_pose` in each of F frames. kept: pose -> arrays to keep. Returns each of
    them with a leading axis F.
    """
    animation = ProceduralAnimation(network, characters=characters, **dict(runtime))
    rows = [kept(animation.next_pose(**target)) for target in targets]
    return [np.array(values) for values in zip(*rows, strict=True)]


@dataclass(frozen=True)
class CrowdTarget:
    """The targets of C figures for a stretch of `frames` frames. They are constant in the stretch.

    gait: (C,) names of gaits. cases: (C,) the values of their channels. A channel of which no case says
    anything has its default. speed: (C,) cm a frame; None: the SPEEDS of the gaits, which then have to be
    keys of SPEEDS.
    """

    frames: int
    gait: Sequence[str]
    cases: Sequence[Case] = field(repr=False)
    speed: Sequence[float] | None = None

    def arguments(self, network: Network) -> dict[str, Array]:
        """The arguments of `next_pose`. Channels that the network does not have are left out."""
        speeds = [SPEEDS[name] for name in self.gait] if self.speed is None else self.speed
        out = {
            "target_velocity": np.column_stack([np.zeros(len(self.gait)), speeds]),
            "gait": np.array([[float(name == gait) for name in network.gaits] for gait in self.gait]),
        }
        for name, columns in network.channels.items():
            if any(name in case for case in self.cases):
                told = [case.get(name, {}) for case in self.cases]
                out[name] = np.array([[of.get(column, 0.0) for column in columns] for of in told])
        return out


@dataclass(frozen=True)
class Walks:
    """The motion of C figures over F frames, which consist of S stretches, one for each `CrowdTarget`.

    skeleton: of all figures. local: (F, C, J, 3) joint positions in root coordinates, cm, float32. contacts:
    (F, C, 4) predicted contacts of left heel, left toe, right heel, right toe. phase: (F, C) from 0 to 1.
    root, yaw: (F, C, 3) positions of the root in the world, cm, and (F, C) its direction, radians.
    acceleration: (F, C) the largest of any joint, cm per frame squared, 0 in the first and last frame.
    starts: (S + 1,) first frame of each stretch, then F.
    """

    skeleton: Skeleton
    local: Array = field(repr=False)
    contacts: Array = field(repr=False)
    phase: Array = field(repr=False)
    root: Array = field(repr=False)
    yaw: Array = field(repr=False)
    acceleration: Array = field(repr=False)
    starts: np.ndarray

    def measured_frames(self, stretch: int, figure: int) -> slice:
        """The frames of stretch number `stretch` in which figure number `figure` is measured.

        The first SETTLING_SHARE of the stretch is left out. After it, as many whole gait cycles as fit are
        measured, up to the end of the stretch. If not even one fits, all frames after the first share are.
        """
        start, stop = int(self.starts[stretch]), int(self.starts[stretch + 1])
        start += round(SETTLING_SHARE * (stop - start))
        # Cycles that the figure has walked since frame `start`, with fractions.
        cycles = np.concatenate([[0.0], np.cumsum(np.mod(np.diff(self.phase[start:stop, figure]), 1.0))])
        whole = np.floor(cycles[-1])
        if whole < 1:
            return slice(start, stop)
        return slice(start + int(np.searchsorted(cycles, cycles[-1] - whole)), stop)

    def cycle(self, stretch: int, figure: int) -> Array:
        """The mean pose of a figure in each phase bin of its gait cycle, measured in a stretch."""
        span = self.measured_frames(stretch, figure)
        return mean_cycle(self.local[span, figure], self.phase[span, figure])

    def distance(self, stretch: int, figure: int, cycle: Array) -> float:
        """Mean distance of a figure's poses in a stretch from `cycle`, cm."""
        span = self.measured_frames(stretch, figure)
        return float(np.mean(distance_to_cycle(self.local[span, figure], self.phase[span, figure], cycle)))

    def change(self, stretch: int, figure: int, reference: int, of_figure: int | None = None) -> float:
        """How far a figure's walk in a stretch is from a reference walk, cm: 0 for the reference walk itself.

        It is the distance from the mean cycle of the reference walk, less the reference walk's own distance.
        reference, of_figure: stretch and figure of the reference walk, by default the same figure.
        """
        other = figure if of_figure is None else of_figure
        cycle = self.cycle(reference, other)
        return self.distance(stretch, figure, cycle) - self.distance(reference, other, cycle)

    def roughness(self, figure: int, stretch: int, end: int = -1) -> float:
        """A figure's largest acceleration from a stretch up to the stretch `end`, or up to the last frame."""
        return float(self.acceleration[self.starts[stretch] : self.starts[end], figure].max())

    def measures(self, stretch: int, figure: int) -> dict[str, float | None]:
        """The `gait_measures` of a figure in a stretch."""
        span = self.measured_frames(stretch, figure)
        return gait_measures(
            self.skeleton, *(a[span, figure] for a in (self.local, self.contacts, self.root))
        )

    def speed(self, stretch: int, figure: int) -> float:
        """A figure's mean speed in a stretch, cm/s."""
        return float(self.measures(stretch, figure)["speed"] or 0.0)


def generate_walks(network: Network, script: Sequence[CrowdTarget], runtime: Runtime) -> Walks:
    """The motion of C figures that follow `script`. They begin standing and walk ahead on flat ground.

    script: one `CrowdTarget` for each stretch, in order. Each figure walks as it would alone, to the last
    bit.
    """
    assert network.skeleton is not None
    targets = (told for stretch in script for told in [stretch.arguments(network)] * stretch.frames)
    count, recent = len(script[0].gait), deque[Array](maxlen=3)  # positions in the last three frames or fewer

    def kept(pose: Pose) -> tuple[Array, ...]:
        recent.append(pose.positions.reshape(count, -1, 3))
        root, yaw = pose.root.reshape(count, 3), np.reshape(pose.yaw, count)
        local = in_root_coordinates(recent[-1], root, yaw).astype(np.float32)
        # That of the frame before.
        largest = acceleration(np.array(recent))[0].max(axis=1) if len(recent) == 3 else np.zeros(count)
        return local, pose.contacts.reshape(count, 4), np.reshape(pose.phase, count), root, yaw, largest

    local, contacts, phase, root, yaw, largest = record(network, runtime, targets, kept, count)
    starts = np.cumsum([0, *(stretch.frames for stretch in script)])
    largest = np.roll(largest, -1, axis=0)
    return Walks(network.skeleton, local, contacts, phase, root, yaw, largest, starts)


def phase_bins(phase: Array) -> np.ndarray:
    """(...) index of the bin of each phase, 0 to PHASES - 1. phase: (...) from 0 to 1."""
    return np.minimum((np.asarray(phase) * PHASES).astype(int), PHASES - 1)


def mean_cycle(local: Array, phase: Array) -> Array:
    """(PHASES, J, 3) mean pose in each phase bin. local: (F, J, 3) joint positions, cm. phase: (F,).

    An empty bin gets the pose of the nearest bin that is not empty.
    """
    bin_of_frame = phase_bins(phase)
    mean = np.zeros((PHASES, *local.shape[1:]))
    filled = np.unique(bin_of_frame)
    for b in filled:
        mean[b] = local[bin_of_frame == b].mean(axis=0)
    for b in set(range(PHASES)) - set(filled.tolist()):
        gap = np.abs(filled - b)
        nearest = np.argmin(np.minimum(gap, PHASES - gap))  # the last bin is next to the first
        mean[b] = mean[filled[nearest]]
    return mean


def distance_to_cycle(local: Array, phase: Array, cycle: Array) -> Array:
    """(F,) distance of each pose from the pose of a mean cycle at the same phase, cm, mean over the joints.

    local: (F, J, 3) joint positions, cm. phase: (F,). cycle: result of `mean_cycle`.
    """
    return np.linalg.norm(local - cycle[phase_bins(phase)], axis=-1).mean(axis=-1)


SIDES = ("left", "right")


def gait_features(skeleton: Skeleton, local: Array, contacts: Array, root: Array) -> dict[str, float]:
    """The results of `gait_measures`, and means and standard deviations (sd) of angles, heights and sway.

    local: (F, J, 3) joint positions in root coordinates, cm. contacts: (F, 4) of left heel, left toe, right
    heel, right toe. root: (F, 3) positions of the root in the world, cm. Returns name -> value. Angles are in
    degrees, lengths in cm, the speed in cm/s. Step lengths and asymmetries are 0 if there is no step.
    """
    measurements = gait_measures(skeleton, local, contacts, root)
    out = {name: value if value is not None else 0.0 for name, value in measurements.items()}
    joints = {
        f"{side}_{part}": local[:, skeleton.role(f"{side}_{part}")].astype(float)
        for side in SIDES
        for part in ("hip", "knee", "heel", "toe", "shoulder", "elbow", "wrist")
    }
    hips, neck = (local[:, skeleton.role(part)].astype(float) for part in ("hips", "neck"))
    for side in SIDES:
        hip, knee, heel, toe = (joints[f"{side}_{part}"] for part in ("hip", "knee", "heel", "toe"))
        shoulder, elbow, wrist = (joints[f"{side}_{part}"] for part in ("shoulder", "elbow", "wrist"))
        angles = {
            "thigh": _swing(knee - hip),
            "knee_bend": bend(hip, knee, heel),
            "ankle": bend(knee, heel, toe),
            "upper_arm": _swing(elbow - shoulder),
            "elbow": bend(shoulder, elbow, wrist),
        }
        for name, angle in angles.items():
            out |= _mean_and_sd(f"{name}_{side}", angle)
        out[f"elbow_out_{side}"] = float(np.mean((elbow - shoulder)[:, 0]))  # to the left, on both sides
        out[f"wrist_height_{side}"] = float(np.mean((wrist - shoulder)[:, 1]))
        out[f"toe_lift_{side}"] = float(np.ptp(toe[:, 1]))
    out |= _mean_and_sd("pelvis_height", hips[:, 1])
    out |= _mean_and_sd("pelvis_sway", hips[:, 0])
    out |= _mean_and_sd("trunk_forward", _swing(hips - neck))  # negative if the trunk leans forward
    out |= _mean_and_sd("trunk_side", np.degrees(np.arctan2((neck - hips)[:, 0], (neck - hips)[:, 1])))
    across = joints["left_shoulder"] - joints["right_shoulder"]
    out |= _mean_and_sd("shoulder_twist", np.degrees(np.arctan2(across[:, 2], across[:, 0])))
    return out


def _swing(down: Array) -> Array:
    """(F,) degrees by which a limb is swung forward; 0 if it points straight down.

    down: (F, 3) from the upper to the lower end of the limb, in root coordinates.
    """
    return np.degrees(np.arctan2(down[:, 2], -down[:, 1]))


def _mean_and_sd(name: str, values: Array) -> dict[str, float]:
    return {f"{name}_mean": float(np.mean(values)), f"{name}_sd": float(np.std(values))}


def mean_of_known(values: Iterable[float | None], digits: int = 5) -> float | None:
    """The mean of the values that are not None, rounded to `digits` decimals; None if there are none."""
    known = [v for v in values if v is not None]
    return round(float(np.mean(known)), digits) if known else None


def rounded(row: Mapping[str, Any]) -> dict[str, Any]:
    """The row with its numbers rounded to five decimals; None in place of numbers that are not finite."""
    return {
        key: (round(float(v), 5) if np.isfinite(v) else None) if isinstance(v, float) else v
        for key, v in row.items()
    }


def share_of_true(values: Sequence[bool] | np.ndarray) -> float | None:
    """The share of values that are true, 0 to 1 with five decimals; None if there are no values."""
    return round(float(np.mean(values)), 5) if len(values) else None


def spearman(x: Sequence[float] | Array, y: Sequence[float | None]) -> float | None:
    """Spearman's rank correlation of the pairs (x, y) in which y is not None.

    None if fewer than 3 pairs remain or if all their y are equal.
    """
    import pandas  # here, because the import takes half a second

    pairs = pandas.DataFrame({"x": x, "y": y}).dropna().astype(float)
    if len(pairs) < 3 or pairs.y.nunique() < 2:
        return None
    return round(float(pairs.x.corr(pairs.y, method="spearman")), 5)
