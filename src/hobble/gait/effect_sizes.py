"""Measures how a hurt walk differs from the same figure's healthy walk."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hobble.gait.people import GAITS, NORMAL, People
from hobble.gait.profile import Profile, mirror_profile
from hobble.gait.recogniser import LEFT, RIGHT

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

    forward, left = change("mean trunk_forward"), change("mean trunk_left")
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


def effects_of_people(recorded: People) -> Mapping[str, Mapping[str, tuple[float, float]]]:
    """Impairment -> name of EFFECTS -> (mean, standard deviation) over the recorded people."""
    out = {}
    for gait in GAITS:  # the normal walk and five impaired ones, see people.py
        if gait == NORMAL:
            continue
        of_people = [
            measure_effects(recorded.profile(gait, person), recorded.profile(NORMAL, person))
            for person in range(recorded.count)
        ]
        values = {name: [of_person[name] for of_person in of_people] for name in EFFECTS}
        out[gait] = {name: (float(np.mean(v)), float(np.std(v))) for name, v in values.items()}
    return out
