"""The thirteen films of the questionnaire.

A healthy character walks, then something begins to hurt. In some films the gait changes, too.

Quentin Ferre (2019) showed four films with one hurt part, five with several and four with a change of gait,
each with the transition from healthy to hurt. We do not know which parts hurt in each film. In his injured
clips, thigh, shank and forearm hurt, so these parts hurt in our films.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hobble.channels.injury.crowd_severities import INJURY, hurt_links
from hobble.channels.injury.crowd_severities import links as links_of
from hobble.channels.injury.shown import OTHER_PARTS, links_between
from hobble.channels.injury.shown import PARTS as SLIDERS
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.options import Runtime

FPS = 60
SEVERITY = 10.0  # the highest, as in the films of Quentin Ferre (2019)
SPEEDS = {"walk": 2.5, "jog": 6.0}  # target speeds, cm a frame
WARM_UP = 4.0  # seconds of walking before a film begins
HEALTHY, HURT = 3.0, 7.0  # seconds before and after the injury begins
CHANGED = 5.0  # seconds that a film with a change of gait is longer; the gait changes in its middle
# The kinds of films.
ONE, SEVERAL, GAIT = "one part", "several parts", "change of gait"
# Parts that people can tick: those that hurt in some film, on both sides, and some that hurt in none.
SIDED = ("thigh", "shank", "foot", "upper arm", "forearm")
PARTS = (*(f"{side} {part}" for part in SIDED for side in ("left", "right")), "lower back", "neck")


@dataclass(frozen=True)
class Film:
    """One film.

    number: from 1, in the order of the tables of answers. kind: ONE, SEVERAL or GAIT. parts: the parts that
    hurt. gaits: target gaits at the beginning and at the end.
    """

    number: int
    kind: str
    parts: tuple[str, ...]
    gaits: tuple[str, str] = ("walk", "walk")

    @property
    def seconds(self) -> float:
        """Length of the film."""
        return HEALTHY + HURT + (CHANGED if self.gaits[0] != self.gaits[1] else 0.0)


FILMS = (
    Film(1, ONE, ("left thigh",)),
    Film(2, ONE, ("right thigh",)),
    Film(3, ONE, ("left shank",)),
    Film(4, ONE, ("left forearm",)),
    Film(5, SEVERAL, ("left thigh", "left shank")),
    Film(6, SEVERAL, ("right thigh", "left shank")),
    Film(7, SEVERAL, ("left shank", "left forearm")),
    Film(8, SEVERAL, ("right thigh", "right forearm")),
    Film(9, SEVERAL, ("right thigh", "left shank", "left forearm")),
    Film(10, GAIT, ("left shank",), ("walk", "jog")),
    Film(11, GAIT, ("right thigh",), ("walk", "jog")),
    Film(12, GAIT, ("left forearm",), ("walk", "jog")),
    Film(13, GAIT, ("left shank", "left forearm"), ("jog", "walk")),
)


@dataclass(frozen=True)
class FilmMotion:
    """The motion of a film at 60 Hz, F frames of J joints in the world.

    positions: (F, J, 3) cm. rotations: (F, J, 4) quaternions. from_healthy: mean distance, cm, between the
    joints and those of a healthy character, averaged over all frames after the injury begins.
    """

    positions: Array
    rotations: Array
    from_healthy: float


def without_side(part: str) -> str:
    """The part without its side: "left thigh" and "right thigh" become "thigh" alone."""
    return part.removeprefix("left ").removeprefix("right ")


def part_links(network: Network, parts: Sequence[str]) -> list[str]:
    """The link that stands for each part.

    A link is the piece of the body between two neighbouring joints. Of the part's links, the uppermost that
    was hurt in training is taken. If none was, the part's uppermost link is taken. Raises HobbleError if the
    network has no injury channel, or if the skeleton has no such part.
    """
    links, hurt = links_of(network), hurt_links(network)
    if network.skeleton is None or not links:
        raise HobbleError("this network has no injury channel. Use a configuration with `channels: [injury]`")
    ends = {label: roles for label, *roles in (*SLIDERS, *OTHER_PARTS)}
    out = []
    for part in parts:
        of_part = [link for link in links_between(network.skeleton, *ends[part]) if link in links]
        if not of_part:
            raise HobbleError(
                f"the skeleton of this network has no {part} that can hurt, but a film needs one"
            )
        out.append(next((link for link in of_part if link in hurt), of_part[0]))
    return out


def film_motion(network: Network, film: Film, runtime: Runtime) -> FilmMotion:
    """The motion of a film. The character goes straight ahead. The injury begins after HEALTHY seconds."""
    severities = dict.fromkeys(part_links(network, film.parts), SEVERITY)
    hurt, healthy = _walked(network, film, severities, runtime), _walked(network, film, {}, runtime)
    begun = round(HEALTHY * FPS)
    apart = np.linalg.norm(_local(hurt[0]) - _local(healthy[0]), axis=-1)[begun:].mean()
    return FilmMotion(*hurt, float(apart))


def hurts_and_gait(film: Film, frame: int) -> tuple[bool, str]:
    """Whether the parts of a film hurt at a frame, and the target gait at this frame."""
    hurts = frame >= HEALTHY * FPS
    changed = frame >= (HEALTHY + HURT) * FPS - CHANGED * FPS / 2
    return hurts, film.gaits[1] if changed else film.gaits[0]


def _walked(
    network: Network, film: Film, severities: dict[str, float], runtime: Runtime
) -> tuple[Array, Array]:
    """Positions and rotations of a character that walks as in a film. severities: link -> value."""
    animation = ProceduralAnimation(network, **dict(runtime))
    before, frames = round(WARM_UP * FPS), round(film.seconds * FPS)
    positions, rotations = [], []
    for frame in range(-before, frames):
        hurts, gait = hurts_and_gait(film, frame)
        pose = animation.next_pose(
            np.array([0.0, SPEEDS[gait]]), None, gait, **{INJURY: severities if hurts else {}}
        )
        if frame >= 0:
            positions.append(pose.positions)
            rotations.append(pose.rotations)
    return np.array(positions), np.array(rotations)


def _local(positions: Array) -> Array:
    """Positions relative to the ground below the first joint, the root."""
    return positions - positions[:, :1] * [1.0, 0.0, 1.0]
