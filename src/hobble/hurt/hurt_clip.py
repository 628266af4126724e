"""Makes the hurt version of a healthy clip: the motion of a person with hurt parts of the body."""

from dataclasses import dataclass, field, replace

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, bone_axes, local_rotations, two_bone_knee
from hobble.core.smooth import gaussian, smooth_above, smoothstep
from hobble.hurt.effects import HIGHEST_SEVERITY, LEFT, RIGHT, SIDES, Effects, effects_of_severities
from hobble.hurt.feet import (
    HurtFoot,
    ground_below,
    join_steps,
    move_foot,
    one_tread_a_stride,
    place_footprints,
    reduce_pitch,
    shorten,
    slope_below,
)
from hobble.hurt.healthy_clip import (
    HealthyClip,
    interpolate_rotations,
    interpolate_values,
    measure_healthy_clip,
)
from hobble.hurt.timing import Timing, relabel, retime
from hobble.hurt.upper_body import change_body
from hobble.labels.clip_labels import Labels

# Radians of knee flexion: a knee that straightens to lift the hips stops here. In the recordings of
# impaired walks, the sound knee is bent by 8 to 10 degrees while a stiff leg swings.
STRAIGHT_KNEE = np.radians(9.0)
MOST_VAULT = np.radians(14.0)  # a knee straightens by at most this, so a crouching figure stays down
# Radians of knee flexion. To spare a leg, its knee bends more, but less so if it is bent by more than the
# first value already, and not at all if by more than the second. So a crouching figure does not sink.
CROUCHED = np.radians([40.0, 90.0])
# A knee is bent by up to this more as its foot lands than later in the stance, radians, on flat ground.
LANDING_BEND = np.radians(10.0)
NEARER = 0.1  # a foot lands near the body if its step is shorter by this share of the healthy step
# Radians of knee flexion. Below the first value, the bend is too small to tell in which direction the knee
# points. Above the second value, the bend is large enough. Between them, it counts partly.
BENT = np.radians([6.0, 18.0])
STRETCH = (0.985, 0.9985)  # least and greatest value of `Leg.longest_reach`, in leg lengths
# For the height of the hips, the horizontal distance between hip and ankle counts as at most this share of
# the leg's length. Otherwise there would be no height at which a leg reaches a foot that is too far away.
LEVEL_SHARE = 0.97

# A leg takes over the body in the first LOADING of its stance, and hands it over in the last UNLOADING.
LOADING, UNLOADING = 0.15, 0.4
# Radians by which a trailing foot rolls over its ball at most, instead of pulling the hips down.
MOST_ROLL = np.radians(45.0)
LEAST_LOAD = 0.02  # so that a leg alone carries the body wholly, even as it begins or ends its stance


@dataclass(frozen=True)
class HurtClip:
    """A hurt clip of N frames.

    severity: (N, L) severities of the L links (the bones that can be hurt), as the motion shows them: after a
    change of the requested severity they follow over about a second. labels: those of the hurt clip.
    source_frames: (N,) the frame of the healthy clip, with fractions, that the body shows in each frame.
    """

    clip: Clip
    severity: Array = field(repr=False)
    labels: Labels = field(repr=False)
    source_frames: Array = field(repr=False)


def hurt_clip(
    clip: Clip,
    labels: Labels,
    severity: Array,
    name: str | None = None,
    flat: bool = True,
    zero: str = "right",
    margins: str = "extend",
    guarding: float | Array = 0.6,
) -> HurtClip:
    """The clip as a person with these severities would walk it.

    labels: those of the clip. severity: (F, L), 0 to 10, of the skeleton's L links. name: name of the result;
    None: the clip's name. flat: whether the ground is flat; on other ground, climbs get lower as steps get
    shorter, and on stairs a badly hurt leg goes last up and first down. zero: the foot that lands at phase 0.
    margins: which gait cycles near the ends of the clip are labelled, see `MARGINS` in
    `hobble.labels.phase`. guarding: 0 to 1, or (F,) of these: how much the whole body spares the hurt part.

    The clip gets longer if the cadence falls. The path keeps its shape, but gets shorter with the steps. If
    all severities are 0, or the clip has fewer than 3 frames, the motion is not changed. Raises HobbleError
    for severities of another shape or range, and for a clip whose bones change their length.
    """
    severity = np.asarray(severity, float)
    if severity.shape != (len(clip), len(clip.skeleton.links)):
        raise HobbleError(
            f"clip {clip.name}: the severities have shape {severity.shape}, but should have shape "
            f"({len(clip)}, {len(clip.skeleton.links)}): frames, links"
        )
    if not ((severity >= 0) & (severity <= HIGHEST_SEVERITY)).all():  # neither if it is not a number
        raise HobbleError(f"clip {clip.name}: every severity should be a number from 0 to 10")
    name = name or clip.name
    if not severity.any() or len(clip) < 3:
        return HurtClip(replace(clip, name=name), severity, labels, np.arange(len(clip), dtype=float))
    if clip.translations is not None:
        raise HobbleError(f"clip {clip.name} has bones that change their length, so it cannot be hurt")
    source = measure_healthy_clip(clip, labels)
    changes = effects_of_severities(clip.skeleton, severity, clip.fps, guarding)
    feet = [reduce_pitch(source, changes, side) for side in (LEFT, RIGHT)]
    ground = np.zeros(len(clip)) if flat else ground_below(source, feet)
    slope = slope_below(source, ground)
    timing = retime(source, changes, slope)
    step_by_step = one_tread_a_stride(changes, slope)
    shift = shorten(source, changes, timing.stride_ratio, ground, step_by_step)
    footprints = place_footprints(source, changes, shift, feet)
    if not flat:
        join_steps(source, changes, feet, footprints, step_by_step)
    feet = [move_foot(source, changes, feet[side], footprints[side], shift, side) for side in (LEFT, RIGHT)]
    out = _assemble(source, changes, timing, shift, feet, name)
    source_frame = np.clip(np.floor(timing.body_frames + 1e-6).astype(int), 0, len(clip) - 1)
    return HurtClip(
        out, changes.shown_severity[source_frame], relabel(labels, timing, zero, margins), timing.body_frames
    )


def _assemble(
    source: HealthyClip, changes: Effects, timing: Timing, shift: Array, feet: list[HurtFoot], name: str
) -> Clip:
    """The hurt clip, put together from the upper body, the height of the hips, and the legs.

    shift: (F, 3) by how much the body moves. Body and legs are sampled at their own times in `timing`.
    """
    clip, skeleton = source.clip, source.clip.skeleton
    world = interpolate_rotations(change_body(source, changes), timing.body_frames)
    root = interpolate_values(clip.root + shift, timing.path_frames)
    legs = [read_leg(clip, side) for side in (LEFT, RIGHT)]
    pelvis = world[:, skeleton.role("hips")]
    hips = [_hip_from_root(source, world, side) for side in (LEFT, RIGHT)]
    ankles = [interpolate_values(feet[side].ankle, timing.leg_frames[:, side]) for side in (LEFT, RIGHT)]
    stands = [interpolate_values(_load(source, side), timing.leg_frames[:, side]) for side in (LEFT, RIGHT)]
    reaches = [_desired_reach(legs[side], changes, source, timing, side) for side in (LEFT, RIGHT)]
    lengths = [leg.longest_reach for leg in legs]
    # Where the hips would be if no leg were too short. Behind the body, such a leg raises its heel.
    free = np.column_stack(
        [root[:, 0], hips_height(root, hips, ankles, reaches, stands, [9 * x for x in lengths]), root[:, 2]]
    )
    balls = [interpolate_values(feet[side].ball, timing.leg_frames[:, side]) for side in (LEFT, RIGHT)]
    heading = interpolate_rotations(source.heading, timing.path_frames)
    rolls = [_roll_over(heading, free + hips[i], ankles[i], balls[i], lengths[i]) for i in (LEFT, RIGHT)]
    ankles = [b + quat.rotate(roll, a - b) for a, b, roll in zip(ankles, balls, rolls, strict=True)]
    root[:, 1] = hips_height(root, hips, ankles, reaches, stands, lengths)
    for side in (LEFT, RIGHT):
        thigh, knee, heel, toe = (skeleton.role(f"{SIDES[side]}_{r}") for r in ("hip", "knee", "heel", "toe"))
        when = timing.leg_frames[:, side]
        world[:, thigh], world[:, knee] = place_leg(
            skeleton, side, legs[side], when, pelvis, root + hips[side], ankles[side]
        )
        foot = interpolate_rotations(feet[side].rotation, when)
        world[:, heel] = quat.mul(rolls[side], foot)
        world[:, toe] = quat.mul(foot, interpolate_rotations(feet[side].toe_rotation, when))
    return Clip(name, skeleton, clip.fps, local_rotations(skeleton, world), root)


def _load(source: HealthyClip, side: int) -> Array:
    """(F,) how much a leg carries, 0 to 1.

    In the last part of a stance the knee bends to leave the ground. The body does not sink with it, since the
    other leg carries it by then.
    """
    load = np.zeros(len(source))
    for stance in source.stances[side]:
        share = np.linspace(0.0, 1.0, stance.off - stance.land + 1)  # of the stance's time
        ramps = smoothstep(share / LOADING) * smoothstep((1 - share) / UNLOADING)
        load[stance.land : stance.off + 1] = np.maximum(ramps, LEAST_LOAD)
    return gaussian(load, 2.0)


def _roll_over(heading: Array, hip: Array, ankle: Array, ball: Array, length: float) -> Array:
    """(N, 4) world rotation about the ball of a foot behind the hip: its heel rises into the leg's reach.

    heading: (N, 4). hip, ankle, ball: (N, 3) positions in the world, cm. length: of the leg, cm.
    """
    across, ahead = (quat.rotate(heading, axis) for axis in np.eye(3)[[0, 2]])
    angles = np.linspace(0.0, MOST_ROLL, 31)
    rolls = [quat.from_axis_angle(across, np.full(len(hip), angle)) for angle in angles]
    away = [np.linalg.norm(ball + quat.rotate(roll, ankle - ball) - hip, axis=1) for roll in rolls]
    # The least angle at which the leg reaches; if there is none, the one at which it is shortest.
    least = angles[np.argmax(np.array(away) <= np.maximum(np.min(away, axis=0), length), axis=0)]
    behind = np.sum((hip - ball) * ahead, axis=1) > 0
    return quat.from_axis_angle(across, smooth_above(np.where(behind, least, 0.0), 2))


def _hip_from_root(source: HealthyClip, world: Array, side: int) -> Array:
    """(N, 3) position of a hip joint relative to the root joint. world: (N, J, 4) world rotations."""
    skeleton = source.clip.skeleton
    joint, out = skeleton.role(f"{SIDES[side]}_hip"), np.zeros((len(world), 3))
    while (parent := skeleton.parents[joint]) >= 0:
        out += quat.rotate(world[:, parent], skeleton.offsets[joint])
        joint = parent
    return out


# Sets the height of the hips so that the standing knee has the desired bend, and places the knees.
#
# The ankle is the joint with the role heel.


@dataclass(frozen=True)
class Leg:
    """A leg of the healthy clip, over F frames.

    reach: (F,) cm from hip to ankle. thigh, shank: (F, 4) rotations relative to the pelvis. hinge: (F, 3)
    axis about which the knee bends, relative to the pelvis. thigh_length, shank_length: cm.
    """

    reach: Array = field(repr=False)
    thigh: Array = field(repr=False)
    shank: Array = field(repr=False)
    hinge: Array = field(repr=False)
    thigh_length: float
    shank_length: float

    @property
    def longest_reach(self) -> float:
        """The largest distance from hip to ankle that is allowed, cm."""
        length = self.thigh_length + self.shank_length
        return float(np.clip(self.reach.max(), STRETCH[0] * length, STRETCH[1] * length))


def read_leg(clip: Clip, side: int) -> Leg:
    """Measure a leg in each frame.

    In frames in which the leg is nearly straight, the direction of its knee is taken from the other frames.
    """
    skeleton = clip.skeleton
    hip, knee, ankle = (skeleton.role(f"{SIDES[side]}_{r}") for r in ("hip", "knee", "heel"))
    positions = clip.positions
    hip_to_ankle = positions[:, ankle] - positions[:, hip]
    reach = np.linalg.norm(hip_to_ankle, axis=1)
    along = hip_to_ankle / np.maximum(reach, 1e-9)[:, None]
    # How far the knee is from the straight line between hip and ankle, and in which direction.
    hip_to_knee = positions[:, knee] - positions[:, hip]
    aside = hip_to_knee - along * np.sum(hip_to_knee * along, axis=1, keepdims=True)
    size = np.linalg.norm(aside, axis=1, keepdims=True)
    upper, lower = (float(np.linalg.norm(skeleton.offsets[j])) for j in (knee, ankle))
    bend = knee_flexion(reach, upper, lower)
    certainty = np.clip((bend - BENT[0]) / (BENT[1] - BENT[0]), 0.0, 1.0)[:, None]
    thigh = clip.global_rotations[:, hip]
    in_thigh = quat.rotate(quat.inv(thigh), aside / np.maximum(size, 1e-9))
    usual = np.sum(in_thigh * certainty, axis=0)
    if certainty.sum() <= 5:  # frames; a knee that never bends is assumed to point as the foot does
        toe = skeleton.role(f"{SIDES[side]}_toe")
        usual = np.mean(quat.rotate(quat.inv(thigh), positions[:, toe] - positions[:, ankle]), axis=0)
    usual = usual / max(float(np.linalg.norm(usual)), 1e-9)
    knee_direction = quat.rotate(thigh, in_thigh * certainty + usual * (1 - certainty))
    to_pelvis = quat.inv(clip.global_rotations[:, skeleton.role("hips")])
    return Leg(
        reach,
        quat.mul(to_pelvis, thigh),
        quat.mul(to_pelvis, clip.global_rotations[:, knee]),
        quat.rotate(to_pelvis, np.cross(knee_direction, along)),
        upper,
        lower,
    )


def knee_flexion(reach: Array, upper: float, lower: float) -> Array:
    """(...) radians of knee flexion, 0 if straight, by the law of cosines.

    reach: (...) distance from hip to ankle. upper, lower: lengths of thigh and shank. All are in cm.
    """
    cosine = (reach**2 - upper**2 - lower**2) / (2 * upper * lower)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def reach_at_flexion(flexion: Array, upper: float, lower: float) -> Array:
    """(...) cm from hip to ankle at a knee flexion (...) in radians: the inverse of `knee_flexion`."""
    return np.sqrt(upper**2 + lower**2 + 2 * upper * lower * np.cos(flexion))


def hips_height(
    root: Array,
    hips: list[Array],
    ankles: list[Array],
    reaches: list[Array],
    stands: list[Array],
    longest: list[float],
) -> Array:
    """(N,) heights of the root, cm, at which standing legs have their desired length.

    root: (N, 3) positions before the change. Each list holds one entry for each leg. hips: (N, 3) position of
    the hip joint relative to the root. ankles: (N, 3) positions in the world. reaches: (N,) desired distance
    from hip to ankle while the leg stands, cm. stands: (N,) from 0 (swings) to 1 (stands). longest: the leg's
    `Leg.longest_reach`. No leg gets longer than this.
    """

    def above_ankle(hip: Array, ankle: Array, length: Array | float) -> Array:
        """(N,) how high the hip is above the ankle if the leg has this length."""
        apart = (root + hip - ankle)[:, [0, 2]]
        return np.sqrt(length**2 - np.minimum(np.sum(apart**2, axis=1), (LEVEL_SHARE * length) ** 2))

    # Each standing leg asks for a change of the root's height. The root gets their weighted mean, smoothed.
    weighted_change = np.zeros(len(root))
    weight = np.full(len(root), 1e-9)
    for hip, ankle, reach, stand in zip(hips, ankles, reaches, stands, strict=True):
        weighted_change += stand * (ankle[:, 1] + above_ankle(hip, ankle, reach) - hip[:, 1] - root[:, 1])
        weight += stand
    height = root[:, 1] + gaussian(weighted_change, 3.0) / gaussian(weight, 3.0)
    # Lower the root where a leg would still be longer than `longest`.
    excess = np.zeros(len(root))
    for hip, ankle, length in zip(hips, ankles, longest, strict=True):
        excess = np.maximum(excess, height + hip[:, 1] - ankle[:, 1] - above_ankle(hip, ankle, length))
    return height - smooth_above(np.maximum(excess, 0.0), 2)


def place_leg(
    skeleton: Skeleton, side: int, leg: Leg, when: Array, pelvis: Array, hip: Array, ankle: Array
) -> tuple[Array, Array]:
    """World rotations of thigh and of shank, (N, 4) each, with which the leg reaches from `hip` to `ankle`.

    when: (N,) frames of the healthy clip, with fractions. The rotations and the direction of the knee in
    these frames are kept as far as the new positions allow. pelvis: (N, 4) world rotations. hip, ankle:
    (N, 3) positions in the world.
    """
    bones = [skeleton.offsets[skeleton.role(f"{SIDES[side]}_{r}")] for r in ("knee", "heel")]
    thigh, shank = (
        quat.mul(pelvis, interpolate_rotations(rotations, when)) for rotations in (leg.thigh, leg.shank)
    )
    hinge = quat.rotate(pelvis, interpolate_values(leg.hinge, when))
    knee, end = two_bone_knee(hip, ankle, np.cross(ankle - hip, hinge), leg.thigh_length, leg.shank_length)
    return _point_bone(thigh, hinge, bones[0], knee - hip), _point_bone(shank, hinge, bones[1], end - knee)


def _point_bone(world: Array, hinge: Array, bone: Array, along: Array) -> Array:
    """Turn world rotations (N, 4) of a bone so that it points along `along` (N, 3).

    bone: (3,) vector of the bone at rest. hinge: (N, 3) axis of the knee in the world. The bone's angle to
    this axis may change, but the bone does not roll against the axis.
    """
    turn = bone_axes(along, hinge) @ np.swapaxes(bone_axes(quat.rotate(world, bone), hinge), -1, -2)
    return quat.mul(quat.from_matrix(turn), world)


def _desired_reach(leg: Leg, changes: Effects, source: HealthyClip, timing: Timing, side: int) -> Array:
    """(N,) desired distance from hip to ankle of a standing leg, cm.

    The knee bends more if the leg is spared (`crouch`). It bends less while the other leg swings stiffly
    (`vault`), which lifts the hips. In a step to the side or backward it does neither: there the leg reaches
    out straight, so a knee that bends in between would move further than a healthy one.
    """
    when, other_when = timing.leg_frames[:, side], timing.leg_frames[:, 1 - side]
    healthy_bend = knee_flexion(leg.reach, leg.thigh_length, leg.shank_length)
    healthy_bend = _stiffer_landing(healthy_bend, changes, source, side)
    crouch = np.radians(changes.changes["crouch"][:, side]) * (1 - source.swing_curve[:, side])
    crouch = crouch * smoothstep((CROUCHED[1] - healthy_bend) / (CROUCHED[1] - CROUCHED[0]))
    ahead = 1 - source.aside
    bend = interpolate_values(healthy_bend + ahead * crouch, when)
    source_vault = np.clip(changes.changes["vault"][:, side], 0.0, 1.0) * source.swing_curve[:, 1 - side]
    vault = interpolate_values(ahead * source_vault, other_when)
    bend = bend - vault * np.clip(bend - STRAIGHT_KNEE, 0.0, MOST_VAULT)
    changed = (interpolate_values(crouch, when) > 0) | (vault > 0)
    return np.where(
        changed,
        reach_at_flexion(bend, leg.thigh_length, leg.shank_length),
        interpolate_values(leg.reach, when),
    )


def _stiffer_landing(bend: Array, changes: Effects, source: HealthyClip, side: int) -> Array:
    """The knee flexion (F,) of the healthy clip, radians, but less where a hurt foot lands.

    Uphill, and in steps backward, a knee is bent far as its foot lands away from the body, and straightens
    as the body follows. A hurt foot lands near the body, and its leg stays as stiff as on the level: of the
    bend beyond LANDING_BEND, it keeps only the square of the share by which it still lifts the foot.
    """
    lift, step = np.minimum(changes.ratio("lift")[:, side], 1.0), changes.changes["step"][:, side]
    stiff = (1 - lift**2) * np.clip(-step / NEARER, 0.0, 1.0)
    less = np.zeros(len(bend))
    for stance in source.stances[side]:
        frames = slice(stance.land, round(stance.middle) + 1)
        least = bend[stance.land : stance.off + 1].min()
        less[frames] = stiff[frames] * np.maximum(bend[frames] - least - LANDING_BEND, 0.0)
    return bend - gaussian(less, 2.0)
