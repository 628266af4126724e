"""Makes the hurt version of a healthy clip: the motion of a person with hurt parts of the body."""

from dataclasses import dataclass, field

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import local_rotations
from hobble.core.smooth import gaussian
from hobble.hurt.effects import HIGHEST_SEVERITY, LEFT, RIGHT, SIDES, Effects, effects_of_severities
from hobble.hurt.healthy_clip import (
    HealthyClip,
    interpolate_rotations,
    interpolate_values,
    measure_healthy_clip,
)
from hobble.hurt.legs import (
    HurtFoot,
    Leg,
    ShortenedPath,
    ground_below,
    hips_height,
    join_steps,
    knee_flexion,
    move_foot,
    place_footprints,
    place_leg,
    reach_at_flexion,
    read_leg,
    reduce_pitch,
    shorten,
)
from hobble.hurt.timing import Timing, relabel, retime
from hobble.hurt.upper_body import change_body
from hobble.labels.clip_labels import Labels

# Radians of knee flexion: a knee that straightens to lift the hips stops here. In the recordings of
# impaired walks, the sound knee is bent by 8 to 10 degrees while a stiff leg swings.
STRAIGHT_KNEE = np.radians(9.0)
MOST_VAULT = np.radians(14.0)  # a knee straightens by at most this, so a crouching figure stays down


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
    if (
        not np.isfinite(severity).all()
        or severity.min(initial=0) < 0
        or severity.max(initial=0) > HIGHEST_SEVERITY
    ):
        raise HobbleError(f"clip {clip.name}: every severity should be a number from 0 to 10")
    name = clip.name if name is None else name
    if not severity.any() or len(clip) < 3:
        unchanged = Clip(name, clip.skeleton, clip.fps, clip.rotations, clip.root, clip.translations)
        return HurtClip(unchanged, severity, labels, np.arange(len(clip), dtype=float))
    if clip.translations is not None:
        raise HobbleError(f"clip {clip.name} has bones that change their length, so it cannot be hurt")
    source = measure_healthy_clip(clip, labels)
    changes = effects_of_severities(clip.skeleton, severity, clip.fps, guarding)
    timing = retime(source, changes)
    feet = [reduce_pitch(source, changes, side) for side in (LEFT, RIGHT)]
    path = shorten(source, changes, timing.stride_ratio, None if flat else ground_below(source, feet))
    footprints = place_footprints(source, changes, path, feet)
    if not flat:
        join_steps(source, changes, feet, footprints)
    feet = [move_foot(source, changes, feet[side], footprints[side], side) for side in (LEFT, RIGHT)]
    out = _assemble(source, changes, timing, path, feet, name)
    source_frame = np.clip(np.floor(timing.body_frames + 1e-6).astype(int), 0, len(clip) - 1)
    return HurtClip(
        out, changes.shown_severity[source_frame], relabel(labels, timing, zero, margins), timing.body_frames
    )


def _assemble(
    source: HealthyClip,
    changes: Effects,
    timing: Timing,
    path: ShortenedPath,
    feet: list[HurtFoot],
    name: str,
) -> Clip:
    """The hurt clip, put together from the upper body, the height of the hips, and the legs.

    Body and legs are sampled at their own times in `timing`.
    """
    clip, skeleton = source.clip, source.clip.skeleton
    world = interpolate_rotations(change_body(source, changes), timing.body_frames)
    shift = np.stack(
        [path.new[:, 0] - path.old[:, 0], path.new_ground - path.old_ground, path.new[:, 1] - path.old[:, 1]],
        axis=1,
    )
    root = interpolate_values(clip.root + shift, timing.body_frames)
    legs = [read_leg(clip, side) for side in (LEFT, RIGHT)]
    pelvis = world[:, skeleton.role("hips")]
    hips = [_hip_from_root(source, world, side) for side in (LEFT, RIGHT)]
    ankles = [interpolate_values(feet[side].ankle, timing.leg_frames[:, side]) for side in (LEFT, RIGHT)]
    stands = [
        interpolate_values(gaussian(1.0 - source.swinging[:, side], 2.0), timing.leg_frames[:, side])
        for side in (LEFT, RIGHT)
    ]
    reaches = [_desired_reach(legs[side], changes, source, timing, side) for side in (LEFT, RIGHT)]
    root[:, 1] = hips_height(root, hips, ankles, reaches, stands, [leg.longest_reach for leg in legs])
    for side in (LEFT, RIGHT):
        thigh, knee, heel, toe = (skeleton.role(f"{SIDES[side]}_{r}") for r in ("hip", "knee", "heel", "toe"))
        when = timing.leg_frames[:, side]
        world[:, thigh], world[:, knee] = place_leg(
            skeleton, side, legs[side], when, pelvis, root + hips[side], ankles[side]
        )
        world[:, heel] = interpolate_rotations(feet[side].rotation, when)
        world[:, toe] = quat.mul(world[:, heel], interpolate_rotations(feet[side].toe_rotation, when))
    return Clip(name, skeleton, clip.fps, local_rotations(skeleton, world), root)


def _hip_from_root(source: HealthyClip, world: Array, side: int) -> Array:
    """(N, 3) position of a hip joint relative to the root joint. world: (N, J, 4) world rotations."""
    skeleton = source.clip.skeleton
    joint, out = skeleton.role(f"{SIDES[side]}_hip"), np.zeros((len(world), 3))
    while (parent := skeleton.parents[joint]) >= 0:
        out += quat.rotate(world[:, parent], skeleton.offsets[joint])
        joint = parent
    return out


def _desired_reach(leg: Leg, changes: Effects, source: HealthyClip, timing: Timing, side: int) -> Array:
    """(N,) desired distance from hip to ankle of a standing leg, cm.

    The knee bends more if the leg is spared (`crouch`). It bends less while the other leg swings stiffly
    (`vault`), which lifts the hips.
    """
    when, other_when = timing.leg_frames[:, side], timing.leg_frames[:, 1 - side]
    crouch = np.radians(changes.changes["crouch"][:, side]) * (1 - source.swing_curve[:, side])
    bend = interpolate_values(knee_flexion(leg.reach, leg.thigh_length, leg.shank_length) + crouch, when)
    source_vault = np.clip(changes.changes["vault"][:, side], 0.0, 1.0) * source.swing_curve[:, 1 - side]
    vault = interpolate_values(source_vault, other_when)
    bend = bend - vault * np.clip(bend - STRAIGHT_KNEE, 0.0, MOST_VAULT)
    changed = (interpolate_values(crouch, when) > 0) | (vault > 0)
    return np.where(
        changed,
        reach_at_flexion(bend, leg.thigh_length, leg.shank_length),
        interpolate_values(leg.reach, when),
    )
