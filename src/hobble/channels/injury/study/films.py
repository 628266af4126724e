"""The thirteen films of the questionnaire.

In each film, a healthy character walks or jogs. Then one or more parts of its body begin to hurt. In some
films the gait changes afterwards.

Quentin Ferre (2019) showed thirteen films, each with the transition from healthy to hurt: four with one hurt
part, five with several and four with a change of gait. We do not know which parts hurt in each of his films.
In his injured clips, thigh, shank and forearm hurt, so these parts hurt in our films.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hobble.channels.injury.crowd_severities import INJURY, injury_links, links_hurt_in_training
from hobble.channels.injury.shown import PARTS_WITH_SLIDER, PARTS_WITHOUT_SLIDER, links_between
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.options import Runtime

FPS = 60  # frames a second of the motion
SEVERITY = 10.0  # the highest severity, as in the films of Quentin Ferre (2019)
SPEEDS = {"walk": 2.5, "jog": 6.0}  # gait -> target speed, cm a frame
WARM_UP_SECONDS = 4.0  # of walking before a film begins
HEALTHY_SECONDS, HURT_SECONDS = 3.0, 7.0  # of a film, before and after the injury begins
# A film with a change of gait is this many seconds longer. The gait changes in the middle of the film.
EXTRA_SECONDS_FOR_CHANGE = 5.0
# The three kinds of films.
ONE_PART, SEVERAL_PARTS, CHANGE_OF_GAIT = "one part", "several parts", "change of gait"
# Parts that people can tick in the questionnaire. They include parts that hurt in no film, such as the neck.
SIDED = ("thigh", "shank", "foot", "upper arm", "forearm")
PARTS = (*(f"{side} {part}" for part in SIDED for side in ("left", "right")), "lower back", "neck")


@dataclass(frozen=True)
class Film:
    """One film.

    number: counted from 1; the tables of answers have this order. kind: ONE_PART, SEVERAL_PARTS or
    CHANGE_OF_GAIT. parts: the parts that hurt. gaits: target gaits at the beginning and at the end.
    """

    number: int
    kind: str
    parts: tuple[str, ...]
    gaits: tuple[str, str] = ("walk", "walk")

    @property
    def seconds(self) -> float:
        """Length of the film, in seconds."""
        return (
            HEALTHY_SECONDS
            + HURT_SECONDS
            + (EXTRA_SECONDS_FOR_CHANGE if self.gaits[0] != self.gaits[1] else 0.0)
        )


FILMS = (
    Film(1, ONE_PART, ("left thigh",)),
    Film(2, ONE_PART, ("right thigh",)),
    Film(3, ONE_PART, ("left shank",)),
    Film(4, ONE_PART, ("left forearm",)),
    Film(5, SEVERAL_PARTS, ("left thigh", "left shank")),
    Film(6, SEVERAL_PARTS, ("right thigh", "left shank")),
    Film(7, SEVERAL_PARTS, ("left shank", "left forearm")),
    Film(8, SEVERAL_PARTS, ("right thigh", "right forearm")),
    Film(9, SEVERAL_PARTS, ("right thigh", "left shank", "left forearm")),
    Film(10, CHANGE_OF_GAIT, ("left shank",), ("walk", "jog")),
    Film(11, CHANGE_OF_GAIT, ("right thigh",), ("walk", "jog")),
    Film(12, CHANGE_OF_GAIT, ("left forearm",), ("walk", "jog")),
    Film(13, CHANGE_OF_GAIT, ("left shank", "left forearm"), ("jog", "walk")),
)


@dataclass(frozen=True)
class FilmMotion:
    """The motion of a film: F frames at 60 Hz of a character with J joints, in world coordinates.

    positions: (F, J, 3) cm. rotations: (F, J, 4) quaternions. cm_from_healthy: distance between the joints
    and the same joints of a character that stays healthy; the mean over all joints and over all frames after
    the injury begins.
    """

    positions: Array
    rotations: Array
    cm_from_healthy: float


def without_side(part: str) -> str:
    """The part without its side: "left thigh" and "right thigh" become "thigh"."""
    return part.removeprefix("left ").removeprefix("right ")


def part_links(network: Network, parts: Sequence[str]) -> list[str]:
    """For each part, the name of the link whose severity is set to make the part hurt.

    A link is the piece of the body between two neighbouring joints. A part may have several links. The
    uppermost link that was hurt in training is taken. If no link of the part was hurt in training, its
    uppermost link is taken. Raises HobbleError if the network has no injury channel, or if the skeleton has
    no such part.
    """
    links, trained = injury_links(network), links_hurt_in_training(network)
    if network.skeleton is None or not links:
        raise HobbleError("this network has no injury channel. Use a configuration with `channels: [injury]`")
    # Part -> roles of the joints at its two ends.
    ends = {label: roles for label, *roles in (*PARTS_WITH_SLIDER, *PARTS_WITHOUT_SLIDER)}
    chosen = []
    for part in parts:
        of_part = [link for link in links_between(network.skeleton, *ends[part]) if link in links]
        if not of_part:
            raise HobbleError(
                f"the skeleton of this network has no {part} that can hurt, but a film of the questionnaire "
                "needs it"
            )
        chosen.append(next((link for link in of_part if link in trained), of_part[0]))
    return chosen


def film_motion(network: Network, film: Film, runtime: Runtime) -> FilmMotion:
    """Generate the motion of a film. The character goes straight ahead."""
    severities = dict.fromkeys(part_links(network, film.parts), SEVERITY)
    positions, rotations = _walk(network, film, severities, runtime)
    healthy_positions, _ = _walk(network, film, {}, runtime)
    first_hurt = round(HEALTHY_SECONDS * FPS)  # the first frame in which the parts hurt
    distances = np.linalg.norm(_local(positions) - _local(healthy_positions), axis=-1)
    return FilmMotion(positions, rotations, float(distances[first_hurt:].mean()))


def hurts_and_gait(film: Film, frame: int) -> tuple[bool, str]:
    """Whether the parts of a film hurt at a frame, and the target gait at this frame.

    frame: 0 is the first frame of the film; frames of the warm-up are negative.
    """
    hurts = frame >= HEALTHY_SECONDS * FPS
    changed = frame >= (HEALTHY_SECONDS + HURT_SECONDS) * FPS - EXTRA_SECONDS_FOR_CHANGE * FPS / 2
    return hurts, film.gaits[1] if changed else film.gaits[0]


def _walk(
    network: Network, film: Film, severities: dict[str, float], runtime: Runtime
) -> tuple[Array, Array]:
    """Positions and rotations, as in `FilmMotion`, of a character that does what a film shows.

    severities: link -> its severity after the injury has begun.
    """
    animation = ProceduralAnimation(network, **dict(runtime))
    warm_up_frames, film_frames = round(WARM_UP_SECONDS * FPS), round(film.seconds * FPS)
    positions, rotations = [], []
    for frame in range(-warm_up_frames, film_frames):
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
