"""A clip beside the healthy walk of the same figure: what it is called, and by how much it differs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from hobble.core.clip import Clip
from hobble.gait.cycles import Walk, joined, measure
from hobble.gait.effects import effects
from hobble.gait.people import NORMAL, people
from hobble.gait.profile import Profile, profile
from hobble.gait.recogniser import RIGHT, Answer, recognise, recognise_windows


@dataclass(frozen=True)
class Comparison:
    """walk: its cycles. profile: its numbers. answer: what the whole clip is called. windows: (first frame,
    answer) of each window of some seconds. effects: side -> sizes, as if that side were the hurt one.
    """

    walk: Walk = field(repr=False)
    profile: Profile = field(repr=False)
    answer: Answer
    windows: Sequence[tuple[int, Answer]] = field(repr=False)
    effects: Mapping[str, Mapping[str, float]] = field(repr=False)

    @property
    def side(self) -> str:
        """The side that is taken for the hurt one; right where the walk is called normal."""
        return self.answer.side or RIGHT

    def named(self) -> dict[str, float]:
        """Share of the windows that are called by each label and side, such as "antalgic right"."""
        names = [f"{a.label} {a.side}" if a.side else NORMAL for _, a in self.windows]
        return {name: names.count(name) / len(names) for name in dict.fromkeys(names)}


def measure_clip(clip: Clip) -> Walk:
    """The cycles of a clip on any skeleton with roles."""
    return measure(clip.skeleton, clip.positions, clip.fps)


def healthy_profile(clips: Sequence[Clip]) -> Profile:
    """The profile of a figure's healthy clips, all cycles together; without any, that of people.

    Raises HobbleError where no clip holds a cycle.
    """
    return profile(joined(measure_clip(clip) for clip in clips)) if clips else people().normal()


def compare(clip: Clip, healthy: Profile, seconds: float = 4.0) -> Comparison:
    """Measure a clip beside a healthy profile; windows last `seconds`. Raises HobbleError without a cycle."""
    walk = measure_clip(clip)
    own = profile(walk)
    return Comparison(
        walk,
        own,
        recognise(own, healthy),
        recognise_windows(walk, healthy, len(clip), seconds),
        {side: effects(own, healthy, side) for side in ("right", "left")},
    )
