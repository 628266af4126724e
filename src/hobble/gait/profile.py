"""Describes a walk by a profile of 52 numbers, and compares it with the same figure's healthy walk.

The comparison has two forms: 17 effects, which say how big a limp is, and 21 features, which distinguish
impairments. Ten people who walked normally and imitated five impairments of the right leg have the same
profiles. They were recorded with a Kinect. Source: Jun et al. (2020), "Pathological gait classification using
Kinect v2 and gated recurrent neural networks", IEEE Access 8. Their profiles and their mean curves are in
`people.npz`, which `benchmarks/derive_gait.py` writes.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.gait.cycles import CURVES, SCALARS, SIGN_CHANGES, Cycle, WalkCycles, join_walks, measure_clip

# The range and mean of each curve and each scalar: degrees, leg lengths, seconds.
Profile = Mapping[str, float]
NO_CYCLE = "there is no whole cycle of straight walking to measure"
PROFILE_NAMES = (*SCALARS, *(f"{statistic} {curve}" for curve in CURVES for statistic in ("range", "mean")))
PEOPLE_FILE = Path(__file__).with_name("people.npz")
SOURCE = "Jun et al. 2020, IEEE Access 8, ten people"
NORMAL = "normal"
GAITS = (NORMAL, "antalgic", "stiff_legged", "steppage", "trendelenburg", "lurch")
RIGHT, LEFT = "right", "left"
# Name of an effect -> its meaning. "hurt" and "sound" are the two sides of the body. "share of healthy" is
# the value of the hurt walk divided by the value of the healthy walk.
EFFECTS: dict[str, str] = {
    "speed": "speed, share of healthy",
    "stride": "stride time, share of healthy",
    "stance": "how much longer the sound leg stands than the hurt leg, as a share of the cycle. The same "
    "difference in the healthy walk is subtracted",
    "step_hurt": "length of the step onto the hurt foot, share of healthy",
    "step_sound": "length of the step onto the sound foot, share of healthy",
    "knee_hurt": "knee range of the hurt leg, share of healthy",
    "knee_sound": "knee range of the sound leg, share of healthy",
    "hip_hurt": "hip flexion range of the hurt leg, share of healthy",
    "hip_sound": "hip flexion range of the sound leg, share of healthy",
    "lean": "angle between the mean directions of the trunk in this walk and in the healthy walk, degrees",
    "lean_forward": "mean lean of the trunk forward, degrees more than healthy",
    "lean_hurt": "mean lean of the trunk to the hurt side, degrees more than healthy",
    "sway_forward": "range of the trunk's forward lean in a cycle, degrees more than healthy",
    "sway_sideways": "range of the trunk's sideways lean in a cycle, degrees more than healthy",
    "pelvis_drop": "mean drop of the pelvis on the sound side, degrees more than healthy",
    "arm_hurt": "swing of the arm of the hurt side, share of healthy",
    "arm_sound": "swing of the arm of the sound side, share of healthy",
}
LEAST_RANGE = 3.0  # degrees: smaller ranges are raised to this, because ratios of tiny ranges are arbitrary
MOST_RATIO = 5.0  # larger ratios are lowered to this
# Names of the features of trunk and arms.
TRUNK_FORWARD, TRUNK_LEFT = "mean trunk_forward", "mean trunk_left"
TRUNK = (TRUNK_FORWARD, TRUNK_LEFT, "range trunk_forward", "range trunk_left")
ARMS = "range arm_forward R - L"


def profile_of_walk(walk: WalkCycles) -> dict[str, float]:
    """The numbers of PROFILE_NAMES: each scalar, and the range and mean of each curve over a cycle.

    Scalars and curves are medians over the cycles. The cycles that begin as the right foot lands have the
    same weight as those that begin as the left foot lands. So the mirrored walk has exactly the mirrored
    profile. Raises HobbleError if the walk has no right cycle or no left cycle.
    """
    if not len(walk):
        raise HobbleError(NO_CYCLE)
    # `walk.left` holds mirrored cycles. Mirroring their profile undoes this.
    right, left = _profile_of_cycles(walk.right), mirror_profile(_profile_of_cycles(walk.left))
    return {name: (right[name] + left[name]) / 2 for name in PROFILE_NAMES}


def profile_of_curves(curves: Array, scalars: Array) -> dict[str, float]:
    """The profile of curves (22, 50) in the order of CURVES, and scalars (8,) in the order of SCALARS."""
    statistics = [float(statistic(curve)) for curve in curves for statistic in (np.ptp, np.mean)]
    return _named((*map(float, scalars), *statistics))


def mirror_profile(values: Profile) -> dict[str, float]:
    """The profile of the mirrored walk."""
    other = {"_R": "_L", "_L": "_R"}
    out = {name: values[name[:-2] + other.get(name[-2:], name[-2:])] for name in PROFILE_NAMES}
    out |= {name: -values[name] for name in (f"mean {curve}" for curve in SIGN_CHANGES)}
    return out | {"left_strike_phase": 1 - values["left_strike_phase"]}


def healthy_profile(clips: Sequence[Clip]) -> Profile:
    """The profile of all cycles of a figure's healthy clips.

    If no clips are given, it is the mean profile of people's normal walks. Raises HobbleError if no clip has
    a cycle.
    """
    if clips:
        return profile_of_walk(join_walks(map(measure_clip, clips)))
    return mean_profile(NORMAL)


def mean_profile(gait: str) -> Profile:
    """The mean profile of the ten people's walks in a gait of GAITS."""
    mean = np.mean([list(person[gait].values()) for person in read_people()], axis=0)
    return _named(map(float, mean))


@cache
def read_people() -> tuple[Mapping[str, Profile], ...]:
    """For each of the ten people: gait of GAITS -> profile. The impaired leg is the right one."""
    profiles = load_npz(PEOPLE_FILE)["profiles"].astype(float)  # (gaits, people, 52)
    return tuple(
        {gait: _named(row.tolist()) for gait, row in zip(GAITS, of_person, strict=True)}
        for of_person in profiles.swapaxes(0, 1)
    )


@cache
def mean_curves() -> Mapping[str, Mapping[str, Array]]:
    """Gait of GAITS -> name of CURVES -> (50,) mean over the ten people; see `Cycle`.

    Each person's curve is the median over the cycles in which the right foot lands first.
    """
    curves = load_npz(PEOPLE_FILE)["curves"].astype(float)
    return {gait: dict(zip(CURVES, some, strict=True)) for gait, some in zip(GAITS, curves, strict=True)}


def _named(values: Iterable[float]) -> dict[str, float]:
    return dict(zip(PROFILE_NAMES, values, strict=True))


def measure_effects(walk: Profile, healthy: Profile, side: str = RIGHT) -> dict[str, float]:
    """Name of EFFECTS -> its size in a walk, relative to the healthy walk of the same figure.

    side: the hurt side, "right" or "left".
    """
    if side == LEFT:  # mirror, so that from here on the right side is the hurt one
        walk, healthy = mirror_profile(walk), mirror_profile(healthy)

    def change(name: str) -> float:
        return walk[name] - healthy[name]

    def share(name: str) -> float:
        return walk[name] / healthy[name] if healthy[name] else float("nan")

    forward, left = change(TRUNK_FORWARD), change(TRUNK_LEFT)
    return {
        "speed": share("speed_per_leg"),  # in leg lengths a second
        "stride": share("stride_seconds"),
        "stance": change("stance_share_L") - change("stance_share_R"),
        "step_hurt": share("step_R"),
        "step_sound": share("step_L"),
        "knee_hurt": share("range knee_flexion_R"),
        "knee_sound": share("range knee_flexion_L"),
        "hip_hurt": share("range hip_flexion_R"),
        "hip_sound": share("range hip_flexion_L"),
        "lean": float(np.hypot(forward, left)),
        "lean_forward": forward,
        "lean_hurt": -left,
        "sway_forward": change("range trunk_forward"),
        "sway_sideways": change("range trunk_left"),
        "pelvis_drop": -change("mean pelvis_left_up"),
        "arm_hurt": share("range arm_forward_R"),
        "arm_sound": share("range arm_forward_L"),
    }


@cache
def effects_of_people() -> Mapping[str, Mapping[str, tuple[float, float]]]:
    """Impairment -> name of EFFECTS -> (mean, standard deviation) over the recorded people."""
    out = {}
    for gait in GAITS[1:]:
        of_people = [measure_effects(person[gait], person[NORMAL]) for person in read_people()]
        values = {name: [effects[name] for effects in of_people] for name in EFFECTS}
        out[gait] = {name: (float(np.mean(v)), float(np.std(v))) for name, v in values.items()}
    return out


def features(walk: Profile, healthy: Profile) -> dict[str, float]:
    """Name of each of 21 features -> its value, relative to the same person's healthy walk.

    Speed and stride time are not used, and many features compare the two sides, because a healthy walk
    changes with its speed but stays symmetric. Most features are differences from the healthy walk, in
    degrees, leg lengths or shares of the cycle. The flexion ranges of knees and hips and the swing of the
    arms are first divided by their healthy values. For knees and hips, the feature is the right ratio minus
    the left one. For the arms, it is the logarithm of the right ratio over the left one.
    """

    def change(name: str) -> float:
        return walk[name] - healthy[name]

    def range_ratio(name: str) -> float:
        now, usual = walk[f"range {name}"], healthy[f"range {name}"]
        return min(max(now, LEAST_RANGE) / max(usual, LEAST_RANGE), MOST_RATIO)

    def right_minus_left(name: str) -> float:
        return change(f"{name}_R") - change(f"{name}_L")

    out = {
        "stance L - R": -right_minus_left("stance_share"),
        "left landing": change("left_strike_phase"),
        "step R - L": right_minus_left("step"),
        "step width": change("step_width"),
        "range hip_abduction R - L": right_minus_left("range hip_abduction"),
        "range ankle_height R - L": right_minus_left("range ankle_height"),
    }
    for part in ("knee_flexion", "hip_flexion"):
        out[f"range {part} R - L"] = range_ratio(f"{part}_R") - range_ratio(f"{part}_L")
    arms = np.log(range_ratio("arm_forward_R") / range_ratio("arm_forward_L"))
    out[ARMS] = float(np.clip(arms, -np.log(MOST_RATIO), np.log(MOST_RATIO)))
    for part in ("knee_flexion", "hip_flexion", "hip_abduction"):
        out |= {f"mean {part} {side}": change(f"mean {part}_{side}") for side in "RL"}
    for part in ("trunk_forward", "trunk_left", "pelvis_left_up"):
        out |= {f"{statistic} {part}": change(f"{statistic} {part}") for statistic in ("range", "mean")}
    return out


def _profile_of_cycles(cycles: Sequence[Cycle]) -> dict[str, float]:
    curves = np.median([cycle.curves for cycle in cycles], axis=0)
    scalars = np.median([[cycle.scalars[name] for name in SCALARS] for cycle in cycles], axis=0)
    return profile_of_curves(curves, scalars)
