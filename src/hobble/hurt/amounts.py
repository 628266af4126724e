"""How much a hurt part changes the motion at severity 10, from profiles of impaired people.

A profile says how real impaired walks differ from the same people's normal walks.

`people.json` was derived with `benchmarks/impairment_profiles.py` from the recordings of Jun et al.
2020 ("Pathological gait classification using Kinect v2 and gated recurrent neural networks", IEEE Access 8).
Ten people each walked normally and imitated five impairments of the right leg. The file holds only means over
these people.
"""

import functools
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import read_json
from hobble.core.quat import Array

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
    "hip": {"trendelenburg": 0.75, "antalgic": 0.25},
    "thigh": {"antalgic": 0.6, "stiff_legged": 0.4},
    "shank": {"antalgic": 0.8, "stiff_legged": 0.15, "steppage": 0.05},
    "foot": {"antalgic": 0.65, "steppage": 0.35},
}
# Part -> factor on the mixed curves of trunk, pelvis and shoulders.
CURVE_FACTOR: dict[str, float] = {"pelvis": 1.6, "hip": 1.8, "thigh": 1.25, "shank": 1.5, "foot": 0.9}
# Part -> changes that the recordings do not show.
# - Ratios to the healthy clip: speed; stride (time); lift (height of the swinging foot); push and strike
#   (pitch of the foot while the heel is up and while the toe is up); arms (swing of both arms); back and head
#   (movement of the joints of back and neck). With a smaller push than these, the heel stays on the ground
#   for so long that the hips sink, and the sound knee bends more than in the recordings.
# - Share: vault (how far the standing knee straightens while the other leg swings; 1 is nearly straight).
# - Leg lengths: out (how far the foot swings outward).
# - Degrees: toe_out; crouch (knee flexion added in stance); forward and side (lean of the trunk forward and
#   to the hurt side); list (pelvis up on the hurt side while that leg swings); nod (head forward).
ADDED_CHANGES: dict[str, dict[str, float]] = {
    "pelvis": {
        "speed": 0.74, "stride": 1.15, "turn": 0.8, "push": 0.65, "back": 0.6, "lift": 0.8,
        "lift_sound": 0.3, "push_sound": 0.75, "list": 2.0,
    },
    "hip": {
        "speed": 0.66, "stride": 1.2, "turn": 0.8, "push": 0.7, "vault": 0.9, "lift": 0.75,
        "lift_sound": 0.3, "push_sound": 0.4, "forward": 2.0, "out": 0.02,
    },
    "thigh": {
        "speed": 0.58, "stride": 1.08, "turn": 0.8, "push": 0.4, "vault": 1.0, "lift": 0.1,
        "lift_sound": 0.3, "push_sound": 0.45, "out": 0.07, "strike": 0.4, "list": 5.0, "toe_out": 8.0,
        "vault_sound": 0.5,
    },
    "shank": {
        "speed": 0.62, "stride": 1.04, "turn": 0.8, "push": 0.55, "lift": 0.4, "lift_sound": 0.3,
        "push_sound": 0.45, "strike": 0.0, "crouch": 19.0, "list": 2.0,
    },
    "foot": {
        "speed": 0.66, "stride": 1.06, "turn": 0.8, "push": 0.15, "lift": 0.6, "lift_sound": 0.3,
        "push_sound": 0.62, "strike": 1.0, "side": 2.5, "toe_out": 18.0,
    },
    "back": {
        "speed": 0.68, "push": 0.6, "push_sound": 0.6, "stride": 1.12, "forward": 17.0, "crouch": 9.0,
        "crouch_sound": 9.0, "back": 0.3, "arms": 0.4, "nod": -5.0,
    },
    "neck": {"speed": 0.85, "head": 0.25, "back": 0.6, "forward": 3.0, "nod": 8.0, "arms": 0.6},
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
    "forward": 27.0, "nod": 10.0, "dip": 16.0, "crouch": 10.0, "crouch_sound": 6.0, "guard": 0.95,
    "guard_sound": 0.75,
}  # fmt: skip
# The changes that are ratios.
RATIOS = (
    "speed", "stride", "turn", "lift_sound", "push", "push_sound", "lift", "strike", "arm", "arm_sound",
    "arms", "back", "head",
)  # fmt: skip
# Factor on the changes of timing in the recordings. The recordings show only half of an early landing,
# because in them a slow ankle counts as stance. Besides, a network that is trained on hurt clips smooths the
# effect.
TIMING_FACTOR = 1.85
# Part -> length of the step onto the hurt foot, as a ratio to the healthy clip. It replaces the ratio of the
# profiles.
STEP_RATIO = {"thigh": 0.2, "shank": 0.44, "foot": 0.58}


@functools.cache
def changes_of_hurt_part(part: str) -> dict[str, float | Array]:
    """Name -> change, for a part that is hurt on the right at severity 10.

    A ratio is given as its difference from 1. The names are those of ADDED_CHANGES and these: `arm`,
    `arm_sound`: ratios of each arm's swing. `off`, `off_sound`, `land_sound`: cycles by which a foot leaves
    or lands later. `step`: ratio of the length of the step onto the hurt foot, minus the ratio that speed and
    stride time alone would give. `width`: leg lengths by which steps are wider. `curves`: (5, 5) factors of
    CURVES, as described in `read_profiles`.
    """
    changes = dict(ADDED_CHANGES[part])
    out: dict[str, float | Array] = {"curves": np.zeros((len(CURVES), 1 + 2 * HARMONICS))}
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
            "curves": curves,
            "land_sound": TIMING_FACTOR * mixed("strike"),
            "off": TIMING_FACTOR * mixed("stance_hurt"),
            "off_sound": TIMING_FACTOR * (mixed("strike") + mixed("stance_sound")),
            "step": min(STEP_RATIO.get(part, mixed("step_hurt")) - stride_length, 0.25),
            "width": mixed("width"),
        }
        arms = {"arm": mixed("arm_hurt"), "arm_sound": min(mixed("arm_sound"), 1.0)}
        changes = {"stride": mixed("stride"), **arms, **changes}
    for name, value in changes.items():
        out[name] = value - 1.0 if name in RATIOS else value
    return out
