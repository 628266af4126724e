"""What hurt parts of the body change in each frame of a clip, from the severities of its links.

Tables say how much a hurt part changes the motion at severity 10. They come from profiles of impaired
people: how real impaired walks differ from the same people's normal walks.

`people.json` was derived with `benchmarks/impairment_profiles.py` from the recordings of Jun et al.
2020 ("Pathological gait classification using Kinect v2 and gated recurrent neural networks", IEEE Access 8).
Ten people each walked normally and imitated five impairments of the right leg. The file holds only means over
these people.
"""

import functools
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hobble.channels.guarding import CHANNEL as GUARDING
from hobble.channels.injury import CHANNEL
from hobble.channels.speed_limits import SUM_NORM
from hobble.core.files import read_json
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.core.smooth import gaussian, smoothstep

PROFILES_FILE = Path(__file__).with_name("people.json")
# Angles over a gait cycle, in degrees. A profile says how each of them changes. The names are those of
# `hobble.gait.cycles`.
CURVES = ("trunk_forward", "trunk_left", "pelvis_left_up", "pelvis_turn_left", "shoulders_turn_left")
HARMONICS = 2  # a profile has the mean and this many harmonics of each curve


@functools.cache
def read_profiles() -> dict[str, dict[str, Any]]:
    """The profiles in PROFILES_FILE by name: antalgic, stiff_legged, steppage, trendelenburg, lurch.

    A profile is a walk with an impairment of the right leg, compared with the same people's normal walk.

    Ratios of the impaired walk to the normal walk: speed; stride (time of a cycle); step_hurt, step_sound
    (length of the step onto the hurt and onto the sound foot); knee (range of the hurt knee's flexion);
    arm_hurt, arm_sound (how far the arm of the hurt and of the sound side swings).

    Differences: strike: cycles by which the sound foot lands later. stance_hurt, stance_sound: cycles by
    which a stance is longer. width: leg lengths by which steps are wider. curves: name of CURVES -> 5 numbers
    in degrees: the change of the curve's mean, then the changes of the factors of cosine and sine of each
    harmonic. The curve begins when the hurt foot lands. Its time is warped so that the sound foot lands half
    a cycle later.
    """
    profiles: dict[str, dict[str, Any]] = read_json(PROFILES_FILE)["profiles"]
    return profiles


# How much a hurt part of the body changes the motion at severity 10.
#
# Two tables decide this. MIXES mixes impairment profiles, which were derived from recordings of people.
# ADDED_CHANGES has the changes that the recordings do not show, because their feet and toes are inaccurate,
# and arms, shoulders, neck and back were not hurt. With a hurt back, the body leans and bends its knees
# (`forward`, `crouch`) about as in clip 105_26 of CMU, which counts as severity 7. Values of one side are for
# a part that is hurt on the right. Names that end with `_sound` are changes of the other side.

# Part -> impairment profiles and their weights. Parts that are not here have only ADDED_CHANGES.
MIXES: dict[str, dict[str, float]] = {
    "pelvis": {"trendelenburg": 0.55, "lurch": 0.25, "antalgic": 0.2},
    "hip": {"trendelenburg": 0.76, "lurch": 0.15, "antalgic": 0.09},
    "thigh": {"antalgic": 0.6, "stiff_legged": 0.4},
    "shank": {"antalgic": 0.8, "stiff_legged": 0.15, "steppage": 0.05},
    "foot": {"antalgic": 0.65, "steppage": 0.35},
}
# Part -> factor on the mixed curves of trunk, pelvis and shoulders.
CURVE_FACTOR: dict[str, float] = {"pelvis": 1.6, "hip": 1.6, "thigh": 1.1, "shank": 1.2, "foot": 0.9}
# Part -> changes that the recordings do not show. Those of hip, thigh, shank and foot were fitted, so that
# the limps of trained networks are like those of people (benchmarks/fit_limps.py).
# - Ratios to the healthy clip: speed; stride (time); lift (height of the swinging foot); push and strike
#   (pitch of the foot while the heel is up and while the toe is up); arm (its swing); back and head
#   (movement of the joints of back and neck). With a smaller push than these, the heel stays on the ground
#   for so long that the hips sink, and the sound knee bends more than in the recordings.
# - Share: vault (how far the standing knee straightens while the other leg swings; 1 is nearly straight).
# - Leg lengths: out (how far the foot swings outward).
# - Degrees: toe_out; crouch (knee flexion added in stance); forward and side (lean of the trunk forward and
#   to the hurt side); list (pelvis up on the hurt side while that leg swings; negative: it drops further);
#   nod (head forward).
# - Cycles: off, off_sound and land_sound, in place of those of the profiles: see `changes_of_hurt_part`. In
#   steps to the side, backward and crouched, a sound foot has no room to land earlier, but a hurt foot can
#   leave earlier.
ADDED_CHANGES: dict[str, dict[str, float]] = {
    "pelvis": {
        "speed": 0.74, "stride": 1.15, "turn": 0.8, "push": 0.65, "back": 0.6, "lift": 0.8,
        "lift_sound": 0.3, "push_sound": 0.75, "list": 2.0,
    },
    "hip": {
        "speed": 0.594, "stride": 1.27, "turn": 0.42, "push": 0.86, "vault": 0.05, "lift": 0.87,
        "crouch": 11.8, "lift_sound": 0.16, "push_sound": 0.08, "off_sound": 0.048, "width": 0.038,
        "vault_sound": 0.86, "arm": 0.85, "arm_sound": 0.85, "forward": -3.6, "list": -0.6,
        "back": 0.48, "side": -1.6,
    },
    "thigh": {
        "speed": 0.645, "stride": 1.09, "turn": 0.03, "push": 0.12, "vault": 0.24, "crouch": 9.8,
        "lift": 0.05, "lift_sound": 0.15, "push_sound": 0.12, "strike": 0.92, "list": -1.1, "arm": 0.65,
        "arm_sound": 0.85, "forward": -1.0, "width": -0.02, "side": 2.1, "back": 0.93, "off": -0.122,
        "off_sound": 0.049, "land_sound": -0.075,
    },
    "shank": {
        "speed": 0.556, "stride": 1.04, "turn": 0.6, "push": 0.14, "lift": 0.29, "lift_sound": 0.38,
        "push_sound": 0.32, "strike": 0.09, "crouch": 13.6, "off_sound": -0.017, "width": 0.105, "out": 0.051,
        "arm": 0.65, "arm_sound": 0.85, "forward": -6.1, "side": -0.2, "list": -1.3, "back": 0.71,
        "off": -0.081, "land_sound": -0.09,
    },
    "foot": {
        "speed": 0.62, "stride": 1.05, "turn": 0.42, "push": 0.63, "lift": 0.61, "lift_sound": 0.16,
        "push_sound": 0.27, "strike": 0.58, "crouch": 2.5, "side": 4.8, "list": -3.6, "toe_out": 14.0,
        "off": -0.104, "off_sound": 0.044, "land_sound": -0.071, "width": -0.02, "vault_sound": 0.96,
        "arm": 0.65, "arm_sound": 0.85, "forward": -7.1,
    },
    "back": {
        "speed": 0.68, "push": 0.6, "push_sound": 0.6, "stride": 1.12, "forward": 17.0, "crouch": 9.0,
        "crouch_sound": 9.0, "back": 0.3, "arm": 0.4, "arm_sound": 0.4, "nod": -5.0,
    },
    "neck": {
        "speed": 0.85, "head": 0.25, "back": 0.6, "forward": 3.0, "nod": 8.0, "arm": 0.6, "arm_sound": 0.6,
    },
    "shoulder": {"speed": 0.88, "side": 2.5, "forward": 2.0, "back": 0.8},
    "upper arm": {"speed": 0.88, "side": 2.0, "forward": 3.0},
    "forearm": {"speed": 0.90, "forward": 2.0},
    "hand": {"speed": 0.94},
}  # fmt: skip
# Changes at severity 10 and guarding 1, for a leg or back that hurts on the right, in addition to the above.
# From CMU 105_25 and the walks of Ferre et al. (2019): trunk 21 to 30 degrees forward, a nod of 12 to 24
# degrees (`dip`) as the hurt foot bears weight, elbows bent by 40 to 77 degrees (`guard`), both knees
# bent, eyes on the ground.
GUARD_CHANGES: dict[str, float] = {
    "forward": 36.0, "nod": 10.0, "dip": 16.0, "crouch": 10.0, "crouch_sound": 6.0, "guard": 0.85,
    "guard_sound": 0.8,
}  # fmt: skip
# The changes that are ratios.
RATIOS = (
    "speed", "stride", "turn", "lift_sound", "push", "push_sound", "lift", "strike", "arm", "arm_sound",
    "back", "head",
)  # fmt: skip
# Factor on the changes of timing in the recordings. The recordings show only half of an early landing,
# because in them a slow ankle counts as stance. Besides, a network that is trained on hurt clips smooths the
# effect.
TIMING_FACTOR = 1.85
# Part -> length of the step onto the hurt foot, as a ratio to the healthy clip. It replaces the ratio of the
# profiles.
STEP_RATIO = {"hip": 0.79, "thigh": 0.18, "shank": 0.37, "foot": 0.41}


@functools.cache
def changes_of_hurt_part(part: str) -> tuple[dict[str, float], Array]:
    """Name -> change, for a part that is hurt on the right at severity 10, and (5, 5) factors of CURVES.

    A ratio is given as its difference from 1. The names are those of ADDED_CHANGES and these: `off`,
    `off_sound`, `land_sound`: cycles by which a foot leaves or lands later. `step`: ratio of the length of
    the step onto the hurt foot, minus the ratio that speed and stride time alone would give. `width`: leg
    lengths by which steps are wider. For the factors see `read_profiles`.
    """
    changes, out = dict(ADDED_CHANGES[part]), {}
    curves: Array = np.zeros((len(CURVES), 1 + 2 * HARMONICS))
    if mix := MIXES.get(part):
        profiles = [(share, read_profiles()[name]) for name, share in mix.items()]

        def mixed(name: str) -> float:
            return float(sum(share * profile[name] for share, profile in profiles))

        harmonics = [share * np.array([p["curves"][name] for name in CURVES]) for share, p in profiles]
        curves = CURVE_FACTOR.get(part, 1.0) * np.sum(harmonics, axis=0)
        # How far pelvis and shoulders turn is the change `turn`.
        curves[CURVES.index("pelvis_turn_left") :, 1:] = 0.0
        # The ratio of the stride's length is the product of the ratios of speed and stride time.
        stride_length = changes["speed"] * changes.get("stride", mixed("stride"))
        out = {
            "land_sound": TIMING_FACTOR * mixed("strike"),
            "off": TIMING_FACTOR * mixed("stance_hurt"),
            "off_sound": TIMING_FACTOR * (mixed("strike") + mixed("stance_sound")),
            "step": min(STEP_RATIO.get(part, mixed("step_hurt")) - stride_length, 0.25),
            "width": mixed("width"),
        }
        arms = {"arm": mixed("arm_hurt"), "arm_sound": min(mixed("arm_sound"), 1.0)}
        changes = {"stride": mixed("stride"), **arms, **changes}
    return out | {name: v - 1.0 if name in RATIOS else v for name, v in changes.items()}, curves


LEFT, RIGHT = 0, 1
SIDES = ("left", "right")
# (role, part): the part reaches down to the joint with this role. It begins at the joint with the previous
# role; the first part begins at the hips (LEG) or the chest (ARM).
LEG = (("hip", "hip"), ("knee", "thigh"), ("heel", "shank"))
ARM = (("shoulder", "shoulder"), ("elbow", "upper arm"), ("wrist", "forearm"))


class BodyPart(NamedTuple):
    """A part of the body: pelvis, hip, thigh, shank, foot, back, neck, shoulder, upper arm, forearm or hand.

    side: LEFT, RIGHT, or None on the midline.
    """

    name: str
    side: int | None


def part_of_link(skeleton: Skeleton, link: tuple[str, str]) -> BodyPart:
    """The part of the body that a link (parent joint, child joint) belongs to."""
    child = skeleton.index(link[1])
    for side, word in enumerate(SIDES):
        for top, limb, last_part in (("hips", LEG, "foot"), ("chest", ARM, "hand")):
            upper = skeleton.role(top)
            for role, name in limb:
                lower = skeleton.role(f"{word}_{role}")
                if child in skeleton.path_up(lower, upper):
                    # Joints between the hips and the hip joint belong to the pelvis.
                    above_hip = role == "hip" and child != lower
                    return BodyPart("pelvis" if above_hip else name, side)
                upper = lower
            if upper in skeleton.path_up(child):  # below the ankle or the wrist
                return BodyPart(last_part, side)
    above_chest = skeleton.role("chest") in skeleton.path_up(skeleton.parents[child])
    return BodyPart("neck" if above_chest else "back", None)


HIGHEST_SEVERITY = 10.0
# strength = (severity / 10) ** STRENGTH_POWER, as a network reads it. So an injury of 3 already shows.
STRENGTH_POWER = CHANNEL.exponent
# The strength of the change of speed: .46 at 3, .64 at 5, .79 at 7.
SPEED_POWER = 0.65
# A person guards an injury with the whole body. GUARD_CHANGES grow with guarding ** GUARD_POWER.
GUARD_POWER = GUARDING.exponent
LEG_PARTS = ("hip", "thigh", "shank", "foot")
GUARDED_PARTS = ("pelvis", *LEG_PARTS, "back")
JOIN_FROM, JOIN_AT = 5.0, 7.0  # `join` grows from 0 to 1 between these severities of a part of the leg
LEAST_RATIO = 0.02  # smaller ratios to the healthy clip are raised to this
SETTLING_SECONDS = 0.3  # sigma of the Gaussian that smooths changes of severity
LEAST_SEVERITY = 0.05  # smaller severities count as 0
WHOLE_BODY = ("speed", "stride", "turn", "back", "head", "forward", "nod")  # changes of the whole body
# Changes of one side. `upper` to `guard` say how much an arm is held in each way (HELD_ARMS in
# `hobble.hurt.upper_body`). `join`, 0 to 1: on stairs the other foot goes first up, this foot first down.
SIDED = (
    "land", "off", "step", "push", "lift", "strike", "out", "width", "toe_out", "crouch", "vault", "arm",
    "side", "list", "dip", "upper", "fore", "carry", "guard", "join",
)  # fmt: skip
SOUND_SUFFIX = "_sound"  # names of changes of the side that is not hurt end with this
# Factors on the CURVES that mirror the body. All curves but the first
# are measured to the left or on the left, so their sign changes.
MIRROR_SIGNS = np.array([1.0, -1.0, -1.0, -1.0, -1.0])
# Signs of a curve's factors (mean, then cosine and sine of each of the two harmonics) when the curve is
# shifted by half a cycle.
HALF_CYCLE_SIGNS = np.array([1.0, -1.0, -1.0, 1.0, 1.0])
# Hurt part of an arm -> how a person holds this arm: a key of HELD_ARMS in `hobble.hurt.upper_body`.
HELD_ARM_OF_PART = {"shoulder": "upper", "upper arm": "upper", "forearm": "fore", "hand": "carry"}


@dataclass(frozen=True)
class Effects:
    """The changes of each of F frames of a clip, named as in ADDED_CHANGES.

    changes: name -> (F,) for changes of the WHOLE_BODY, (F, 2), left and right, for SIDED ones. curves:
    (F, 5, 5) factors of CURVES, as in `read_profiles`. shown_severity: (F, L)
    severities of the L links, as the motion shows them: after a change of the requested severity they follow
    over about a second.
    """

    changes: dict[str, Array] = field(repr=False)
    curves: Array = field(repr=False)
    shown_severity: Array = field(repr=False)

    def ratio(self, name: str) -> Array:
        """A change of RATIOS as a ratio to the healthy clip: (F,) or (F, 2)."""
        return np.maximum(1.0 + self.changes[name], LEAST_RATIO)


def effects_of_severities(
    skeleton: Skeleton, severity: Array, fps: float, guarding: Array | float = 0.0
) -> Effects:
    """The effects of severities (F, L), 0 to 10, of the skeleton's links (the bones that can be hurt).

    guarding: (F,) or one number, 0 to 1, how much the whole body spares the hurt part.

    If several links hurt, the result is at least the effect of the worst link and less than the sum of all.
    """
    frames = len(severity)
    strength = gaussian(
        (np.clip(severity, 0, HIGHEST_SEVERITY) / HIGHEST_SEVERITY) ** STRENGTH_POWER, SETTLING_SECONDS * fps
    )
    terms: dict[str, list[Array]] = {name: [np.zeros(frames)] for name in WHOLE_BODY}
    terms |= {name: [np.zeros((frames, 2))] for name in SIDED}
    curves: list[Array] = [np.zeros((frames, 5, 5))]
    parts: dict[BodyPart, Array] = {}
    for link, column in zip(skeleton.links, strength.T, strict=True):
        # Several links of one part, such as fingers, count as one link: the worst.
        part = part_of_link(skeleton, link)
        parts[part] = np.maximum(parts.get(part, 0.0), column)
    guarded = np.broadcast_to(np.clip(guarding, 0.0, 1.0) ** GUARD_POWER, frames)

    def add(name: str, values: Array, side: int | None) -> None:
        """Add values (F,) to the terms of a change. side: the hurt side."""
        if name in WHOLE_BODY:
            terms[name].append(values)
            return
        both = np.zeros((frames, 2))
        hurt = RIGHT if side is None else side  # a part on the midline changes both sides alike
        both[:, 1 - hurt if name.endswith(SOUND_SUFFIX) else hurt] = values
        terms[name.removesuffix(SOUND_SUFFIX)].append(both)

    for (name_of_part, side), part_strength in parts.items():
        if not part_strength.any():
            continue
        changes, of_part = changes_of_hurt_part(name_of_part)
        curves.append(part_strength[:, None, None] * _curves_of_side(of_part, side))
        for name, amount in changes.items():
            power = SPEED_POWER / STRENGTH_POWER if name == "speed" else 1.0
            add(name, part_strength**power * amount, side)
        if name_of_part in GUARDED_PARTS and guarded.any():
            # An injury on the midline is guarded by both sides, each at a share with which their sum is 1.
            sides = (LEFT, RIGHT) if side is None else (side,)
            share = len(sides) ** (-1 / SUM_NORM)
            for name, amount in GUARD_CHANGES.items():
                for each in sides:
                    add(name, share * guarded * part_strength * amount, each)
        if name_of_part in LEG_PARTS:
            worst = HIGHEST_SEVERITY * np.clip(part_strength, 0.0, 1.0) ** (1 / STRENGTH_POWER)
            add("join", smoothstep((worst - JOIN_FROM) / (JOIN_AT - JOIN_FROM)), side)
        if name_of_part in HELD_ARM_OF_PART:
            add(HELD_ARM_OF_PART[name_of_part], part_strength, side)
    shown = np.round(HIGHEST_SEVERITY * np.clip(strength, 0.0, 1.0) ** (1 / STRENGTH_POWER), 3)
    shown = np.where(shown < LEAST_SEVERITY, 0.0, shown)
    return Effects({name: _together(each) for name, each in terms.items()}, _together(curves), shown)


def _curves_of_side(curves: Array, side: int | None) -> Array:
    """The factors (5, 5) for a part hurt on `side`, from those for the right side.

    For the left side the body is mirrored. The curves are also shifted by half a cycle, because phase 0 stays
    the landing of the right foot.
    """
    return curves * MIRROR_SIGNS[:, None] * HALF_CYCLE_SIGNS if side == LEFT else curves


def _together(terms: list[Array]) -> Array:
    """A sum in which large terms count most: p-norm of the positive minus p-norm of the negative terms."""
    up, down = (
        np.sum([np.maximum(sign * term, 0.0) ** SUM_NORM for term in terms], axis=0) ** (1 / SUM_NORM)
        for sign in (1.0, -1.0)
    )
    return np.asarray(up - down)
