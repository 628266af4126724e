"""Describes a walk by a profile: 52 numbers, computed from medians over its cycles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.gait.cycles import SCALARS, Cycle, WalkCycles
from hobble.gait.signals import CURVES, SIGN_CHANGES

Profile = Mapping[str, float]
NO_CYCLE = "there is no whole cycle of straight walking to measure"
PROFILE_NAMES = (*SCALARS, *(f"{statistic} {curve}" for curve in CURVES for statistic in ("range", "mean")))


def profile_of_walk(walk: WalkCycles) -> dict[str, float]:
    """The numbers of PROFILE_NAMES: each scalar, and the range and mean of each curve over a cycle.

    Scalars and curves are medians over the cycles. The cycles that begin as the right foot lands have the
    same weight as those that begin as the left foot lands. So the mirrored walk has exactly the mirrored
    profile. Units: degrees, leg lengths, seconds. Raises HobbleError if the walk has no right
    cycle or no left cycle.
    """
    if not len(walk):
        raise HobbleError(NO_CYCLE)
    # `walk.left` holds mirrored cycles. Mirroring their profile undoes this.
    right, left = _profile_of_cycles(walk.right), mirror_profile(_profile_of_cycles(walk.left))
    return {name: (right[name] + left[name]) / 2 for name in PROFILE_NAMES}


def profile_of_curves(curves: Array, scalars: Array) -> dict[str, float]:
    """The profile of curves (22, 50) in the order of CURVES, and scalars (8,) in the order of SCALARS."""
    out = {name: float(value) for name, value in zip(SCALARS, scalars, strict=True)}
    for name, curve in zip(CURVES, curves, strict=True):
        out[f"range {name}"] = float(np.ptp(curve))
        out[f"mean {name}"] = float(np.mean(curve))
    return {name: out[name] for name in PROFILE_NAMES}


def mirror_profile(values: Profile) -> dict[str, float]:
    """The profile of the mirrored walk."""
    out = {}
    for name in PROFILE_NAMES:
        statistic, _, curve = name.rpartition(" ")
        if name == "left_strike_phase":
            out[name] = 1 - values[name]
        elif statistic == "mean" and curve in SIGN_CHANGES:
            out[name] = -values[name]
        else:
            out[name] = values[_other_side(name)]
    return out


def _other_side(name: str) -> str:
    """The name with _R for _L and the reverse. Other names stay as they are."""
    if name.endswith("_R"):
        return f"{name[:-1]}L"
    return f"{name[:-1]}R" if name.endswith("_L") else name


def _profile_of_cycles(cycles: Sequence[Cycle]) -> dict[str, float]:
    curves = np.median([cycle.curves for cycle in cycles], axis=0)
    scalars = np.median([[cycle.scalars[name] for name in SCALARS] for cycle in cycles], axis=0)
    return profile_of_curves(curves, scalars)
