"""Profiles of impairments: how real impaired walks differ from the same people's normal walks.

`people.json` was derived with `python -m hobble.hurt IMPAIRED_WALKS.npz` from the recordings of Jun et al.
2020 ("Pathological gait classification using Kinect v2 and gated recurrent neural networks", IEEE Access 8).
Ten people each walked normally and imitated five impairments of the right leg. Only means over people are
kept.
"""

from __future__ import annotations

import functools
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import load_npz, read_json, write_json
from hobble.core.quat import Array

FILE = Path(__file__).with_name("people.json")
# Curves over a cycle, in degrees, whose changes a profile holds; named as in `hobble.gait.signals`.
CURVES = ("trunk_forward", "trunk_left", "pelvis_left_up", "pelvis_turn_left", "shoulders_turn_left")
HARMONICS = 2  # a profile keeps the mean and this many harmonics of each curve
NORMAL = "normal"
SOURCE = "Jun et al. 2020, IEEE Access 8: means over ten people who imitated impairments of the right leg"


@dataclass(frozen=True)
class Profile:
    """An impairment of the right leg, relative to the same people's normal walk.

    Ratios: speed, stride (time), step_hurt, step_sound (length of the step onto the hurt or the sound foot),
    knee (range of the hurt knee), arm_hurt, arm_sound (swing). strike: cycles by which the sound foot lands
    later. stance_hurt, stance_sound: cycles by which a stance is longer. width: leg lengths by which steps
    are wider. curves: for each of CURVES its change in degrees: the mean, then the factors of cosine and sine
    of each harmonic. A cycle starts as the hurt foot lands; its time is warped so that the sound foot lands
    half a cycle later.
    """

    speed: float
    stride: float
    strike: float
    stance_hurt: float
    stance_sound: float
    step_hurt: float
    step_sound: float
    width: float
    knee: float
    arm_hurt: float
    arm_sound: float
    curves: dict[str, list[float]]

    def harmonics(self) -> Array:
        """(5, 1 + 2 * HARMONICS) factors of CURVES."""
        return np.array([self.curves[name] for name in CURVES])


@functools.cache
def profiles() -> dict[str, Profile]:
    """The profiles of the package by name: antalgic, stiff_legged, steppage, trendelenburg, lurch."""
    return {name: Profile(**values) for name, values in read_json(FILE)["profiles"].items()}


def derive(walks: str | Path, path: str | Path = FILE) -> None:
    """Write the profiles of a file of impaired walks.

    walks: npz with `gaits`, `curves` and `scalars` (names), `curve` (gaits, people, curves, 50) over a cycle
    from the right landing, and `scalar` (gaits, people, scalars). Raises InputError if an array is missing.
    """
    data = load_npz(walks)
    gaits = [str(name) for name in data["gaits"]]
    derived = {
        gait: asdict(_profile(data, i, gaits.index(NORMAL))) for i, gait in enumerate(gaits) if gait != NORMAL
    }
    for profile in derived.values():
        for name, value in profile.items():
            profile[name] = _rounded(value)
    write_json(path, {"source": SOURCE, "profiles": derived})


def _profile(data: Any, gait: int, normal: int) -> Profile:
    scalars = {str(n): data["scalar"][:, :, i] for i, n in enumerate(data["scalars"])}
    curves = {str(n): data["curve"][:, :, i] for i, n in enumerate(data["curves"])}

    def ratio(values: Array) -> float:
        return float(values[gait].mean() / values[normal].mean())

    def more(name: str) -> float:
        return float(np.mean(scalars[name][gait] - scalars[name][normal]))

    def swing(name: str) -> float:
        return ratio(np.ptp(curves[name].astype(float), axis=-1))

    strike = scalars["left_strike_phase"]
    return Profile(
        speed=ratio(scalars["speed_per_leg"]),
        stride=ratio(scalars["stride_seconds"]),
        strike=more("left_strike_phase"),
        stance_hurt=more("stance_share_R"),
        stance_sound=more("stance_share_L"),
        step_hurt=ratio(scalars["step_R"]),
        step_sound=ratio(scalars["step_L"]),
        width=more("step_width"),
        knee=swing("knee_flexion_R"),
        arm_hurt=swing("arm_forward_R"),
        arm_sound=swing("arm_forward_L"),
        curves={
            name: list(
                _harmonics(curves[name][gait], strike[gait])
                - _harmonics(curves[name][normal], strike[normal])
            )
            for name in CURVES
        },
    )


def _harmonics(curve: Array, strike: Array) -> Array:
    """(5,) factors of a curve (people, 50), mean over people.

    Each person's time is warped so that the left foot lands at .5 and not at `strike` (people,).
    """
    steps = curve.shape[-1]
    phase = np.arange(steps) / steps
    rows = [np.ones(steps)]
    for h in range(1, HARMONICS + 1):
        rows += [np.cos(2 * np.pi * h * phase), np.sin(2 * np.pi * h * phase)]
    weights = np.stack(rows, axis=1) * np.array([1.0] + [2.0] * 2 * HARMONICS) / steps
    out = []
    for values, landing in zip(curve, strike, strict=True):
        warped = np.interp(phase, [0.0, 0.5, 1.0], [0.0, landing, 1.0])
        out.append(np.interp(warped, np.append(phase, 1.0), np.append(values, values[0])) @ weights)
    return np.mean(out, axis=0)


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: [round(float(x), 2) for x in row] for name, row in value.items()}
    return round(float(value), 3)
