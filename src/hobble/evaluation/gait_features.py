"""Describes a stretch of walking with fifty numbers, so that injuries, moods and diagnoses are recognised."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.evaluation.motion_measures import bend, gait_measures

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
