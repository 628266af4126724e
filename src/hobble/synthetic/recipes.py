"""What each clip does: a recipe is a sequence of segments, each a gait, a velocity and a turn for a time."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace

import numpy as np

from hobble.core.errors import HobbleError

STAND, WALK, JOG, CROUCH = "stand", "walk", "jog", "crouch"
INJURED = "injured"


@dataclass(frozen=True)
class Segment:
    """One stretch of a plan.

    speed: cm/s. heading: degrees from the facing direction to the direction of travel, + to the left.
    turn: degrees the facing direction turns over the whole segment, + to the left. seconds: how long.
    """

    gait: str
    speed: float = 0.0
    turn: float = 0.0
    seconds: float = 2.5
    heading: float = 0.0


def _walk(speed: float, turn: float = 0.0, seconds: float = 2.5, heading: float = 0.0) -> Segment:
    return Segment(WALK, speed, turn, seconds, heading)


def _jog(speed: float, turn: float = 0.0, seconds: float = 2.5) -> Segment:
    return Segment(JOG, speed, turn, seconds)


def _crouch(speed: float, turn: float = 0.0, seconds: float = 2.5, heading: float = 0.0) -> Segment:
    return Segment(CROUCH, speed, turn, seconds, heading)


def _stand(seconds: float = 2.0) -> Segment:
    return Segment(STAND, seconds=seconds)


RECIPES: dict[str, tuple[Segment, ...]] = {
    "walk-straight": (_walk(130, 0, 4), _walk(150, 8, 3), _walk(105, -8, 3), _walk(130, 0, 3)),
    "walk-turns": (
        *(_walk(130, 0, 1.6), _walk(115, 90, 1.8), _walk(130, 0, 1.6), _walk(115, -90, 1.8)),
        *(_walk(135, 0, 1.4), _walk(90, -170, 2.8), _walk(130, 0, 1.4), _walk(90, 170, 2.8)),
    ),
    "walk-curves": (
        *(_walk(130, 150, 4), _walk(130, -150, 4), _walk(90, -100, 3.5), _walk(90, 100, 3.5)),
        *(_walk(170, 80, 3), _walk(170, -80, 3)),
    ),
    "walk-speeds": (_walk(70, 10, 3.5), _walk(110, -10, 3), _walk(180, 0, 3.5), _walk(50, 5, 3.5)),
    "jog": (_jog(250, 0, 3), _jog(300, 20, 2.5), _jog(350, -20, 2.5), _jog(420, 0, 2.5), _jog(250, 0, 2)),
    "jog-turns": (
        *(_jog(280, 0, 1.5), _jog(260, 90, 1.7), _jog(280, 0, 1.5), _jog(260, -90, 1.7)),
        *(_jog(300, 120, 3), _jog(300, -120, 3)),
    ),
    "crouch": (
        *(_crouch(70, 0, 3), _crouch(90, 60, 3), _crouch(90, -60, 3), _crouch(0, 0, 1.8), _crouch(110, 0, 3)),
        *(_walk(120, 0, 2.5), _crouch(80, 0, 3)),
    ),
    "strafe": (
        *(_walk(110, 0, 1.8), _walk(62, 0, 2.6, 90), _walk(62, 0, 2.6, -90), _walk(110, 0, 1.8)),
        *(_walk(90, 0, 2.4, 45), _walk(90, 0, 2.4, -45), _stand(1.6)),
    ),
    "backward": (
        *(_walk(110, 0, 1.8), _walk(65, 0, 3, 180), _walk(70, 25, 2.2, 180), _walk(70, -25, 2.2, 180)),
        *(_stand(1.6), _walk(65, 0, 2.2, 140), _walk(65, 0, 2.2, -140)),
    ),
    "stop-and-go": (
        *(_stand(4.2), _walk(130, 0, 2.2), _stand(4.2), _walk(20, 90, 1.7), _walk(100, 0, 2)),
        *(_stand(3.2), _walk(20, -90, 1.7), _jog(250, 0, 2.2), _stand(3.4)),
    ),
    "walk-jog-walk": (
        *(_walk(130, 0, 2.5), _jog(270, 0, 3), _walk(140, 15, 2.5), _jog(330, -15, 3)),
        *(_walk(90, 0, 2.5), _jog(240, 0, 2.5)),
    ),
    "slopes": (_walk(125, 0, 4), _walk(110, 60, 3), _walk(125, 0, 3), _walk(110, -60, 3), _jog(240, 0, 2.5)),
    "steps": (_walk(85, 0, 4), _walk(70, 12, 3), _walk(100, -12, 3), _stand(1.8)),
    "uneven": (_walk(115, 0, 3), _walk(95, 70, 3), _walk(125, -70, 3), _walk(70, 0, 2.5)),
    INJURED: (_walk(125, 0, 3), _walk(130, 40, 2), _walk(115, -40, 2), _jog(230, 0, 2)),
}
GROUND = {"slopes": "slopes", "steps": "steps", "uneven": "uneven"}  # the others are planned on flat ground


def plan(recipe: str, frames: float, fps: float, seed: int, clip: str) -> list[Segment]:
    """The segments of a clip of `frames` frames, each a little different by the clip's own generator.

    The recipe is walked as often as fits best, at three quarters of its time or more, the turns of
    every other round mirrored; an injured clip starts anywhere in it.
    Raises HobbleError for a recipe that there is not.
    """
    if recipe not in RECIPES:
        raise HobbleError(f"clip {clip}: there is no recipe {recipe!r}. There are: {', '.join(RECIPES)}.")
    rng = generator(seed, clip, "plan")
    segments = RECIPES[recipe]
    side = 1.0 if rng.random() < 0.5 else -1.0
    start = int(rng.integers(len(segments))) if recipe == INJURED else 0
    segments = segments[start:] + segments[:start]
    seconds = frames / fps
    once = sum(segment.seconds for segment in segments)
    rounds = max(1, round(seconds / once))
    pace = max(0.75, seconds / (rounds * once))
    out: list[Segment] = []
    while sum(s.seconds for s in out) < seconds:
        out += [_varied(segment, side, pace, rng) for segment in segments]
        side = -side
    return out


def _varied(segment: Segment, side: float, pace: float, rng: np.random.Generator) -> Segment:
    speed, turn, seconds = rng.uniform([0.93, 0.9, 0.95], [1.07, 1.1, 1.05])
    return replace(
        segment,
        speed=segment.speed * speed,
        turn=segment.turn * turn * side,
        seconds=segment.seconds * seconds * pace,
        heading=segment.heading * side,
    )


def generator(seed: int, clip: str, purpose: str) -> np.random.Generator:
    """The random generator of one clip for one purpose: the same on every machine and in every run."""
    return np.random.default_rng([seed, zlib.crc32(clip.encode()), zlib.crc32(purpose.encode())])
