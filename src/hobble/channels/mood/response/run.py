"""Measures whether a recogniser of captured moods recognises generated ones.

Also compares sizes of effects.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.core.section import Section
from hobble.core.skeleton import Skeleton
from hobble.evaluation.captured import Captured, captured_clips
from hobble.evaluation.crowd import FPS, Stretch, channel_values
from hobble.evaluation.crowd import run as run_walks
from hobble.evaluation.gait_features import features
from hobble.gait.discriminant import Discriminant, learn
from hobble.measures.given import Given, Outcome
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.layout import GAITS
from hobble.runtime.options import Runtime

MOOD = "mood"  # the channel
WALK = GAITS.index("walk")
NONE = "none"
WINDOW, STEP = 60, 15  # frames; a window is about a cycle
AHEAD = 0.9  # least share of a window's speed that is forward
LEAST_SPEED = 0.5  # of a window, cm a frame
WARM_UP, USED = 4 * FPS, 6 * FPS  # frames of a generated walk that are skipped, and that are used
PACES = (0.85, 1.0, 1.15)  # of the median speed of captured neutral walks; the same for every mood
ASKED = 120.0  # cm a second, if there are no captured neutral walks
VALUES = (0.5, 1.0)
MIRROR = "_mirror"
# Of the covariance towards its diagonal. With .6, 69 % of the left-out captured windows are recognised. With
# the .02 of the other recogniser it is 54 %, because each mood has only one or two clips.
SHRINKAGE = 0.6
REASON = "this network has no moods among its inputs"
TOO_FEW = "there are walking clips of fewer than two moods"
EFFECTS = ("speed", "stride", "trunk", "arms", "head")


@dataclass(frozen=True)
class Window:
    """A stretch of straight walking: its clip, its mood (or NONE) and its features."""

    clip: str
    mood: str
    values: Mapping[str, float] = field(repr=False)
    effects: Mapping[str, float] = field(repr=False)


def response(
    network: Network, motion: Iterable[Captured], splits: Mapping[str, str], runtime: Runtime
) -> dict[str, Any]:
    """The content of mood.json. If it cannot be measured, `applies` is false and `reason` says why.

    captured: results for windows of captured clips. Each clip (with its mirror) is left out in turn and
    recognised with what was learnt from the others. generated: for each mood and value the share of `windows`
    recognised with what was learnt from all clips. For two moods together: the share recognised as either,
    and how far the walk is `between` the two single moods. effects: of each mood, captured and generated,
    minus the neutral walk's: speed (m/s), stride (cm), trunk and head (degrees forward), arms (degrees of
    swing, standard deviation).
    """
    if MOOD not in network.channels or network.skeleton is None:
        return {"applies": False, "reason": REASON}
    windows = [w for clip in motion if splits[clip.clip] == "train" for w in captured_windows(clip, network)]
    known = sorted({w.mood for w in windows} - {NONE})
    if len(known) < 2:
        return {"applies": False, "reason": TOO_FEW}
    judge = learn(_table(windows), [w.mood for w in windows], SHRINKAGE)
    speed = float(np.median([w.values["speed"] for w in windows if w.mood == NONE] or [ASKED])) / FPS
    figures = [
        {},
        *({mood: v} for v in VALUES for mood in known),
        *(dict.fromkeys(p, 1.0) for p in combinations(known, 2)),
    ]
    walks = generated(network, figures, speed, runtime)
    alone = {mood: _mean(walks[1 + len(known) + i]) for i, mood in enumerate(known)}
    rows = [_named(judge, figure, some) for figure, some in zip(figures, walks, strict=True)]
    for row, figure, some in zip(rows, figures, walks, strict=True):
        if len(figure) == 2:
            row["between"] = _between(_mean(some), *(alone[mood] for mood in figure))
    full = {mood: walks[1 + len(known) + i] for i, mood in enumerate(known)}
    half = {mood: walks[1 + i] for i, mood in enumerate(known)}
    return {
        "applies": True,
        "moods": known,
        "speed_asked": round(speed * FPS / 100, 5),
        "captured": left_out(windows),
        "generated": rows,
        "right_at_1": _share([n for row in rows if row["value"] == 1.0 for n in row["right"]]),
        "effects": [
            {
                "mood": mood,
                "effect": effect,
                **_sizes(effect, mood, windows, walks[0], half[mood], full[mood]),
            }
            for mood in known
            for effect in EFFECTS
        ],
    }


def captured_windows(clip: Captured, network: Network) -> list[Window]:
    """The windows of a captured stretch that walks straight in one mood at its highest value, or in none."""
    assert network.skeleton is not None
    columns = network.channels[MOOD]
    out = []
    for start in range(0, len(clip) - WINDOW + 1, STEP):
        span = slice(start, start + WINDOW)
        speed = np.hypot(*clip.velocity[span].mean(axis=0))
        moods = [columns[i] for i in np.flatnonzero(clip.channels[MOOD][start])]
        straight = clip.velocity[span, 1].mean() >= AHEAD * speed and speed >= LEAST_SPEED
        if not straight or len(moods) > 1 or clip.gait[span, WALK].mean() <= 0.5:
            continue
        parts = clip.local[span], clip.contacts[span], clip.root[span]
        out.append(_window(network.skeleton, clip.clip, moods[0] if moods else NONE, *parts))
    return out


def generated(
    network: Network, figures: Sequence[Mapping[str, float]], speed: float, runtime: Runtime
) -> list[list[Window]]:
    """The windows of each figure's straight walks at all PACES. figures: mood -> value."""
    assert network.skeleton is not None
    asked = [(i, figure, pace) for i, figure in enumerate(figures) for pace in PACES]
    values = channel_values(network, MOOD, [figure for _, figure, _ in asked])
    script = Stretch(WARM_UP + USED, ["walk"] * len(asked), values, [speed * pace for *_, pace in asked])
    walks = run_walks(network, [script], runtime)
    out: list[list[Window]] = [[] for _ in figures]
    for c, (i, figure, _) in enumerate(asked):
        for start in range(WARM_UP, WARM_UP + USED - WINDOW + 1, STEP):
            span = slice(start, start + WINDOW)
            parts = walks.local[span, c], walks.contacts[span, c], walks.root[span, c]
            out[i].append(_window(network.skeleton, "", " and ".join(figure) or NONE, *parts))
    return out


def left_out(windows: Sequence[Window]) -> dict[str, Any]:
    """Windows of each clip and its mirror, recognised with what was learnt from the other clips."""
    right: dict[str, list[bool]] = {}
    for clip in sorted({_original(w.clip) for w in windows}):
        rest = [w for w in windows if _original(w.clip) != clip]
        mine = [w for w in windows if _original(w.clip) == clip]
        if len({w.mood for w in rest}) > 1:
            names = learn(_table(rest), [w.mood for w in rest], SHRINKAGE).names(_table(mine))
            for w, name in zip(mine, names, strict=True):
                right.setdefault(w.mood, []).append(w.mood == name)
    return {
        "clips": len({_original(w.clip) for w in windows}),
        "windows": sum(map(len, right.values())),
        "right": _share([r for some in right.values() for r in some]),
        "by_mood": {mood: _share(some) for mood, some in right.items()},
    }


def run(given: Given, options: Section) -> Outcome:
    """mood.json, and the effects as a table."""
    motion = captured_clips(given.clips.values())
    result = response(load_network(given.weights), motion, given.splits, given.runtime)
    says = f"moods named right: {result['right_at_1']}" if result["applies"] else result["reason"]
    return Outcome(_plain(result), {"effects": result.get("effects", [])}, says)


def _window(skeleton: Skeleton, clip: str, mood: str, local: Array, contacts: Array, root: Array) -> Window:
    values = features(skeleton, local, contacts, root)
    head, neck = (local[:, skeleton.role(part)].astype(float) for part in ("head", "neck"))
    up = (head - neck).mean(axis=0)
    effects = {
        "speed": values["speed"] / 100,
        "stride": values["step_left"] + values["step_right"],
        "trunk": -values["trunk_forward_mean"],  # that one is of the way down
        "arms": (values["upper_arm_left_sd"] + values["upper_arm_right_sd"]) / 2,
        "head": float(np.degrees(np.arctan2(up[2], up[1]))),
    }
    return Window(clip, mood, {**values, "head": effects["head"]}, effects)


def _named(judge: Discriminant, figure: Mapping[str, float], windows: Sequence[Window]) -> dict[str, Any]:
    names = judge.names(_table(windows))
    wanted = set(figure) or {NONE}
    return {
        "moods": list(figure),
        "value": next(iter(figure.values()), 0.0) if len(figure) < 2 else None,
        "windows": len(names),
        "right": [name in wanted for name in names],
        "share": _share([name in wanted for name in names]),
        "named": {name: names.count(name) for name in sorted(set(names))},
    }


def _sizes(
    effect: str,
    mood: str,
    windows: Sequence[Window],
    plain: Sequence[Window],
    half: Sequence[Window],
    full: Sequence[Window],
) -> dict[str, float]:
    def mean(some: Iterable[Window]) -> float:
        return float(np.mean([w.effects[effect] for w in some]))

    captured = mean(w for w in windows if w.mood == mood) - mean(w for w in windows if w.mood == NONE)
    base = mean(plain)
    sizes = {"captured": captured, "generated": mean(full) - base, "generated_at_half": mean(half) - base}
    return {name: round(size, 4) for name, size in sizes.items()}


def _between(both: Array, first: Array, second: Array) -> float:
    """Position of the mean features of `both` between those of the first (0) and the second mood (1)."""
    way = second - first
    return round(float((both - first) @ way / max(float(way @ way), 1e-9)), 4)


def _mean(windows: Sequence[Window]) -> Array:
    return _table(windows).mean(axis=0)


def _table(windows: Sequence[Window]) -> Array:
    return np.array([list(w.values.values()) for w in windows])


def _original(clip: str) -> str:
    return clip.removesuffix(MIRROR)


def _share(right: Sequence[bool]) -> float | None:
    return round(sum(right) / len(right), 5) if right else None


def _plain(result: dict[str, Any]) -> dict[str, Any]:
    rows = [{k: v for k, v in row.items() if k != "right"} for row in result.get("generated", ())]
    return {**result, **({"generated": rows} if rows else {})}
