"""What hurts, when, and how it changes the way the figure moves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import gaussian_filter1d

from hobble.core.quat import Array
from hobble.synthetic.gait import Style
from hobble.synthetic.links import LEFT, LINKS, RIGHT

SEVERITIES = (0, 3, 5, 7, 10)
LENGTHS = (0.7, 1.0, 1.0, 1.0, 1.1)  # of the stretches, relative

# At severity 10. A factor multiplies, `+` adds, `=` is what the value becomes; all in proportion to severity.
# A sided value is that of the hurt side, unless its name ends in _sound (the other side) or _all (both).
EFFECTS: dict[str, dict[str, tuple[str, float]]] = {
    "thigh": {  # a stiff leg, swung around with the hip raised, the trunk thrown over it
        **{"duty": ("+", -0.18), "duty_sound": ("+", 0.05), "lag_hurt": ("+", -0.12), "shift": ("+", -7.0)},
        **{"off_pitch": ("*", 0.45), "heel_off": ("+", 0.14), "land_pitch": ("*", 0.35), "lift": ("+", -2.0)},
        **{"clearance": ("*", 0.5), "swing_out": ("+", 10.0), "hike": ("+", 8.0), "side_lean": ("+", 18.0)},
        **{"sway": ("+", 2.5), "frequency": ("*", 1.24), "arm_swing_all": ("*", 0.6)},
    },
    "shank": {  # set down flat and lifted early, the knee soft
        **{"duty": ("+", -0.18), "duty_sound": ("+", 0.05), "lag_hurt": ("+", -0.12), "shift": ("+", -6.0)},
        **{"off_pitch": ("*", 0.25), "heel_off": ("+", 0.10), "land_pitch": ("*", 0.0), "lift": ("+", -1.0)},
        **{"clearance": ("*", 0.8), "toe_out": ("+", 5.0), "side_lean": ("+", 11.0), "sway": ("+", 1.2)},
        **{"frequency": ("*", 1.24), "height": ("+", -2.0), "arm_swing_all": ("*", 0.75)},
    },
    "foot": {  # on the heel, turned out, no roll over the toe
        **{"duty": ("+", -0.14), "duty_sound": ("+", 0.03), "lag_hurt": ("+", -0.09), "shift": ("+", -4.0)},
        **{"off_pitch": ("*", 0.08), "heel_off": ("+", 0.2), "land_pitch": ("*", 1.1), "flat": ("+", 0.10)},
        **{"lift": ("+", 3.0), "toe_out": ("+", 22.0), "side_lean": ("+", 6.0), "frequency": ("*", 1.14)},
        **{"arm_swing_all": ("*", 0.9)},
    },
    "back": {  # bent forward and stiff
        **{
            "lean": ("+", 24.0),
            "pelvis_tilt": ("+", 4.0),
            "pelvis_yaw": ("*", 0.3),
            "pelvis_list": ("*", 0.4),
        },
        **{"chest_yaw": ("*", 0.15), "arm_swing_all": ("*", 0.35), "elbow_all": ("+", 12.0)},
        **{"off_pitch_all": ("*", 0.7), "frequency": ("*", 1.02), "bob": ("*", 0.4), "height": ("+", -1.5)},
    },
    "upper arm": {  # held against the body
        **{"arm_swing": ("*", 0.0), "elbow_swing": ("*", 0.0), "elbow": ("=", 62.0), "abduction": ("=", 3.0)},
        **{"arm_mean": ("=", 2.0), "twist": ("=", 62.0), "chest_yaw": ("*", 0.5), "lean": ("+", 5.0)},
    },
    "forearm": {  # carried in front of the chest
        **{
            "arm_swing": ("*", 0.0),
            "elbow_swing": ("*", 0.0),
            "elbow": ("=", 112.0),
            "abduction": ("=", 9.0),
        },
        **{"arm_mean": ("=", 16.0), "twist": ("=", 38.0), "chest_yaw": ("*", 0.75), "lean": ("+", 1.5)},
    },
}
SPEED = {"thigh": 0.50, "shank": 0.52, "foot": 0.66, "back": 0.62, "upper arm": 0.86, "forearm": 0.90}


def slowing(severity: Array, link: str) -> Array:
    """(F,) factor on the speed of travel."""
    return 1 - (1 - SPEED[LINKS[link][0]]) * severity / 10


def schedule(frames: int) -> list[tuple[int, int]]:
    """(first frame, severity) of each stretch of a clip, in order."""
    ends = np.cumsum(LENGTHS) / np.sum(LENGTHS) * frames
    return [(round(start), s) for start, s in zip((0.0, *ends[:-1]), SEVERITIES, strict=True)]


def at_footsteps(changes: Sequence[tuple[int, int]], landings: Sequence[int]) -> list[tuple[int, int]]:
    """The same stretches, each but the first moved to the nearest frame in which a foot lands.

    Of those that so begin in the same frame, as they do in a short clip, the last is left.
    """
    frames = np.asarray(landings)
    moved = dict(changes[:1])
    for start, severity in changes[1:]:
        moved[int(frames[np.argmin(np.abs(frames - start))])] = severity
    return list(moved.items())


def smoothed(changes: Sequence[tuple[int, int]], frames: int, first: int, fps: float) -> Array:
    """(frames + 2 first,) severity that the motion follows: from one value to the next in about a cycle."""
    steps = np.zeros(frames)
    for start, value in changes:
        steps[start:] = value
    padded = np.pad(steps, first, mode="edge")
    return gaussian_filter1d(padded, 0.3 * fps, mode="nearest")


def hurt(style: Style, severity: Array, link: str) -> Style:
    """The style with one link hurt; severity (F,) 0 to 10. Every effect is in proportion to severity."""
    part, side = LINKS[link]
    share = np.asarray(severity) / 10
    changes: dict[str, Array] = {}
    for effect, (how, amount) in EFFECTS[part].items():
        if effect == "lag_hurt":
            # The sound foot lands early, while the hurt one still stands.
            changes["lag"] = style.lag + (amount if side == RIGHT else -amount) * share
            continue
        name = effect.removesuffix("_all").removesuffix("_sound")
        new = np.array(changes.get(name, getattr(style, name)))
        if new.ndim == 1:
            new = _apply(how, amount, new, share)
        for s in _sides(effect, side) if new.ndim == 2 else ():
            new[:, s] = _apply(how, amount, new[:, s], share)
        changes[name] = new
    return style.changed(**changes)


def _sides(effect: str, hurt_side: int) -> tuple[int, ...]:
    if effect.endswith("_all"):
        return LEFT, RIGHT
    return (1 - hurt_side,) if effect.endswith("_sound") else (hurt_side,)


def _apply(how: str, amount: float, value: Array, share: Array) -> Array:
    if how == "*":
        return value * (1 + (amount - 1) * share)
    if how == "+":
        return value + amount * share
    return value + (amount - value) * share
