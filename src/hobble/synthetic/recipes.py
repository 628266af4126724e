"""Recipes for clips. A recipe is a sequence of segments, each with a gait, a velocity, a turn and a length.

The plan of a clip is its recipe, repeated, stretched and varied at random to fill the clip.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace

import numpy as np

from hobble.core.errors import HobbleError

STAND, WALK, JOG, CROUCH = "stand", "walk", "jog", "crouch"


@dataclass(frozen=True)
class Segment:
    """One segment of a recipe or a plan.

    speed: cm/s. turn: degrees by which the facing direction turns in the segment, positive to the left.
    seconds: length of the segment. heading: degrees from the facing direction to the direction of travel,
    positive to the left.
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


# Arguments of each segment: speed, turn, seconds, heading; see `Segment`. The inner tuples only keep several
# segments on one line.
RECIPES: dict[str, tuple[Segment, ...]] = {
    "walk-straight": (_walk(130, 0, 4), _walk(150, 8, 3), _walk(105, -8, 3), _walk(130, 0, 3)),
    "walk": (
        *(_walk(130, 0, 3), _walk(150, 90, 3), _walk(105, -100, 3), _walk(70, 20, 2.6), _walk(180, 0, 2.6)),
        *(_walk(120, 90, 1.2), _walk(130, 0, 1.4), _walk(95, -180, 2), _walk(60, 0, 2.4), _walk(130, 0, 1.4)),
        *(_walk(130, 170, 3.4), _walk(170, -140, 3.4), _walk(90, 175, 1.7), _walk(135, 0, 2)),
        *(_walk(115, -90, 1.4), _walk(100, 0, 1.4)),
    ),
    "jog": (
        *(_jog(250, 0, 2), _jog(330, 20, 2), _jog(420, -20, 2.2), _jog(280, 90, 1.3), _jog(300, 0, 1.2)),
        *(_jog(260, -170, 2), _jog(215, 0, 1.6), _jog(300, 140, 2.4), _jog(370, 0, 1.6), _jog(400, -60, 2.4)),
        *(_jog(240, 100, 1.4), _jog(290, 0, 1.4)),
    ),
    "crouch": (
        *(_crouch(70, 0, 3), _crouch(90, 90, 2.4), _crouch(90, -90, 2.4), _crouch(0, 0, 1.8)),
        *(_crouch(110, 0, 3), _walk(120, 0, 2.2), _crouch(80, 0, 2.6)),
    ),
    "sidesteps": (
        *(_walk(110, 0, 1.8), _walk(62, 0, 2.6, 90), _walk(62, 0, 2.6, -90), _walk(110, 0, 1.6)),
        *(_walk(90, 0, 2.2, 45), _walk(90, 0, 2.2, -45), _stand(1.6), _walk(65, 0, 1.6)),
        *(_walk(65, 0, 2.6, 180), _walk(70, 30, 2, 180), _walk(70, -30, 2, 180), _walk(65, 0, 2, 140)),
        *(_walk(65, 0, 2, -140), _walk(110, 0, 2.6, 165), _walk(110, 0, 2.4, -165), _walk(100, 0, 2.2, 90)),
        *(_walk(100, 0, 2.2, -90), _walk(125, 0, 1.8, 30), _walk(125, 0, 1.8, -30)),
    ),
    "stop-and-go": (
        *(_stand(3.6), _walk(130, 0, 2), _stand(3.2), _walk(8, 90, 1.7), _walk(80, 0, 1.8)),
        *(_stand(3.0), _walk(8, 180, 3.0), _walk(8, -90, 1.7), _jog(235, 0, 2.4), _stand(3)),
    ),
    "walk-jog-walk": (
        *(_walk(130, 0, 2.2), _jog(270, 0, 2.5), _walk(140, 60, 2), _jog(340, -60, 2.5)),
        *(_walk(90, 0, 2.2), _jog(230, 0, 2)),
    ),
    "slopes": (_walk(125, 0, 4), _walk(110, 60, 3), _jog(240, 0, 2.5), _walk(125, -60, 3), _walk(90, 0, 2)),
    "steps": (_walk(85, 0, 4), _walk(70, 12, 3), _walk(100, -12, 3), _stand(1.8)),
    "uneven": (_walk(115, 0, 3), _walk(95, 70, 3), _walk(125, -70, 3), _walk(70, 0, 2.5)),
}
# recipe -> kind of ground, see `hobble.synthetic.planned_ground`; all other recipes are on flat ground
GROUND = {"slopes": "slopes", "steps": "steps", "uneven": "uneven"}


def plan(recipe: str, frames: float, fps: float, seed: int, clip: str) -> list[Segment]:
    """The plan of a clip of `frames` frames: segments that last at least as long as the clip.

    The recipe is repeated as often as fits best. Then the segments are stretched or shortened to fill the
    clip, but to no less than three quarters of their length. Every other repetition is mirrored. Each segment
    is varied a little at random; equal arguments give an equal plan.

    Raises HobbleError for an unknown recipe.
    """
    if recipe not in RECIPES:
        raise HobbleError(
            f"clip {clip}: there is no recipe {recipe!r}. Name one of these: {', '.join(RECIPES)}."
        )
    rng = random_generator(seed, clip, "plan")
    segments = RECIPES[recipe]
    mirror = 1.0 if rng.random() < 0.5 else -1.0  # factor of turns and headings
    seconds = frames / fps
    once = sum(segment.seconds for segment in segments)
    repetitions = max(1, round(seconds / once))
    stretch = max(0.75, seconds / (repetitions * once))
    out: list[Segment] = []
    while sum(s.seconds for s in out) < seconds:
        out += [_vary(segment, mirror, stretch, rng) for segment in segments]
        mirror = -mirror
    return out


def _vary(segment: Segment, mirror: float, stretch: float, rng: np.random.Generator) -> Segment:
    """The segment with speed, turn and length changed by random factors. mirror: -1 to mirror it, else 1."""
    speed_factor, turn_factor, time_factor = rng.uniform([0.93, 0.9, 0.95], [1.07, 1.1, 1.05])
    return replace(
        segment,
        speed=segment.speed * speed_factor,
        turn=segment.turn * turn_factor * mirror,
        seconds=segment.seconds * time_factor * stretch,
        heading=segment.heading * mirror,
    )


def random_generator(seed: int, clip: str, purpose: str) -> np.random.Generator:
    """The random generator of one clip for one purpose. It is the same on every machine and in every run."""
    return np.random.default_rng([seed, zlib.crc32(clip.encode()), zlib.crc32(purpose.encode())])
