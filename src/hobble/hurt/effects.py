"""Turns the severities of the links into the changes of each frame of a clip."""

from dataclasses import dataclass, field

import numpy as np

from hobble.channels.injury import CHANNEL
from hobble.channels.speed_limits import SUM_NORM
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.core.smooth import gaussian, smoothstep
from hobble.hurt.amounts import GUARD_CHANGES, changes_of_hurt_part

LEFT, RIGHT = 0, 1
SIDES = ("left", "right")
# (role, part): the part reaches down to the joint with this role. It begins at the joint with the previous
# role; the first part begins at the hips (LEG) or the chest (ARM).
LEG = (("hip", "hip"), ("knee", "thigh"), ("heel", "shank"))
ARM = (("shoulder", "shoulder"), ("elbow", "upper arm"), ("wrist", "forearm"))


@dataclass(frozen=True)
class BodyPart:
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
                if child in path_up(skeleton, lower, upper):
                    # Joints between the hips and the hip joint belong to the pelvis.
                    above_hip = role == "hip" and child != lower
                    return BodyPart("pelvis" if above_hip else name, side)
                upper = lower
            if upper in path_up(skeleton, child):  # below the ankle or the wrist
                return BodyPart(last_part, side)
    if child in path_up(skeleton, skeleton.role("chest"), skeleton.role("hips")):
        return BodyPart("back", None)
    if skeleton.role("chest") in path_up(skeleton, child):
        return BodyPart("neck", None)
    return BodyPart("back", None)


def path_up(skeleton: Skeleton, joint: int, below: int = -1) -> list[int]:
    """The joint itself, its parent, and so on: to the root, or to the joint under the joint `below`.

    Empty if `below` is not an ancestor of the joint.
    """
    out = [joint]
    while skeleton.parents[out[-1]] != below:
        if skeleton.parents[out[-1]] < 0:
            return []
        out.append(skeleton.parents[out[-1]])
    return out


# Combines the severities of several links into the changes of each frame of a clip.


HIGHEST_SEVERITY = 10.0
# strength = (severity / 10) ** STRENGTH_POWER, as a network reads it. So an injury of 3 already shows.
STRENGTH_POWER = CHANNEL.exponent
# The strength of the change of speed: .46 at 3, .64 at 5, .79 at 7.
SPEED_POWER = 0.65
# A person guards an injury with the whole body. GUARD_CHANGES grow with guarding ** GUARD_POWER.
GUARD_POWER = 2.6
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
# Factors on the CURVES (see `hobble.hurt.amounts`) that mirror the body. All curves but the first
# are measured to the left or on the left, so their sign changes.
MIRROR_SIGNS = np.array([1.0, -1.0, -1.0, -1.0, -1.0])
# Signs of a curve's factors (mean, then cosine and sine of each of the two harmonics) when the curve is
# shifted by half a cycle.
HALF_CYCLE_SIGNS = np.array([1.0, -1.0, -1.0, 1.0, 1.0])
# Hurt part of an arm -> how a person holds this arm: a key of HELD_ARMS in `hobble.hurt.upper_body`.
HELD_ARM_OF_PART = {"shoulder": "upper", "upper arm": "upper", "forearm": "fore", "hand": "carry"}


@dataclass(frozen=True)
class Effects:
    """The changes of each of F frames of a clip, named as in `hobble.hurt.amounts`.

    changes: name -> (F,) for changes of the WHOLE_BODY, (F, 2), left and right, for SIDED ones. curves:
    (F, 5, 5) factors of CURVES, as in `read_profiles` of `hobble.hurt.amounts`. shown_severity: (F, L)
    severities of the L links, as the motion shows them: after a change of the requested severity they follow
    over about a second.
    """

    changes: dict[str, Array] = field(repr=False)
    curves: Array = field(repr=False)
    shown_severity: Array = field(repr=False)

    def ratio(self, name: str) -> Array:
        """A change of RATIOS (`hobble.hurt.amounts`) as a ratio to the healthy clip: (F,) or (F, 2)."""
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
    parts: dict[tuple[str, int | None], Array] = {}
    for link, column in zip(skeleton.links, strength.T, strict=True):
        body_part = part_of_link(skeleton, link)
        # Several links of one part, such as fingers, count as one link: the worst.
        key = (body_part.name, body_part.side)
        parts[key] = np.maximum(parts.get(key, 0.0), column)
    guarded = np.broadcast_to(np.clip(guarding, 0.0, 1.0) ** GUARD_POWER, frames)

    def add(name: str, values: Array, side: int | None) -> None:
        """Add values (F,) to the terms of a change. side: the hurt side."""
        if name in WHOLE_BODY:
            terms[name].append(values)
            return
        both = np.zeros((frames, 2))
        if name == "arms":  # the change "arm" of both sides
            name, both = "arm", both + values[:, None]
        else:
            hurt = RIGHT if side is None else side  # a part on the midline changes both sides alike
            both[:, 1 - hurt if name.endswith(SOUND_SUFFIX) else hurt] = values
        terms[name.removesuffix(SOUND_SUFFIX)].append(both)

    for (part, side), part_strength in parts.items():
        if not part_strength.any():
            continue
        for name, amount in changes_of_hurt_part(part).items():
            if name == "curves":
                curves.append(part_strength[:, None, None] * _curves_of_side(np.asarray(amount), side))
            elif name == "speed":
                add(name, part_strength ** (SPEED_POWER / STRENGTH_POWER) * amount, side)
            else:
                add(name, part_strength * amount, side)
        if part in GUARDED_PARTS and guarded.any():
            # An injury on the midline is guarded by both sides, each at a share with which their sum is 1.
            sides = (LEFT, RIGHT) if side is None else (side,)
            share = len(sides) ** (-1 / SUM_NORM)
            for name, amount in GUARD_CHANGES.items():
                for each in sides:
                    add(name, share * guarded * part_strength * amount, each)
        if part in LEG_PARTS:
            worst = HIGHEST_SEVERITY * np.clip(part_strength, 0.0, 1.0) ** (1 / STRENGTH_POWER)
            add("join", smoothstep((worst - JOIN_FROM) / (JOIN_AT - JOIN_FROM)), side)
        if part in HELD_ARM_OF_PART and side is not None:
            add(HELD_ARM_OF_PART[part], part_strength, side)
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
