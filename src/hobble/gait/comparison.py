"""Compares a clip with a healthy walk of the same figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from hobble.core.clip import Clip
from hobble.gait.cycles import WalkCycles, join_walks, measure_cycles
from hobble.gait.effect_sizes import measure_effects
from hobble.gait.limp_grade import Grade, grade_walk
from hobble.gait.people import read_people
from hobble.gait.profile import Profile, profile_of_walk
from hobble.gait.recogniser import RIGHT, SIDES, Impairment, recognise, windows_with_cycles


@dataclass(frozen=True)
class WalkComparison:
    """Measurements of a clip and the recognisers' answers.

    walk: the clip's cycles. profile: medians over these cycles. answer: what the linear classifier
    (recogniser.py) says of the whole clip. grade: what the graded recogniser (limp_grade.py) says of the
    whole clip; it also recognises mild limps. window_answers: (first frame, answer) of each window, a stretch
    of a few seconds. window_grades: (first frame, grade) of each window. effects: "right" or "left" -> the
    result of `effect_sizes.measure_effects` if this side is hurt.
    """

    walk: WalkCycles = field(repr=False)
    profile: Profile = field(repr=False)
    answer: Impairment
    grade: Grade
    window_answers: Sequence[tuple[int, Impairment]] = field(repr=False)
    window_grades: Sequence[tuple[int, Grade]] = field(repr=False)
    effects: Mapping[str, Mapping[str, float]] = field(repr=False)

    @property
    def side(self) -> str:
        """The side that counts as hurt; right if the walk is recognised as normal."""
        return self.answer.side or RIGHT

    def answer_shares(self) -> dict[str, float]:
        """Answer of the linear classifier, such as "antalgic right" -> share of the windows."""
        return _shares([answer for _, answer in self.window_answers])

    def grade_shares(self) -> dict[str, float]:
        """Answer of the graded recogniser, such as "antalgic right" -> share of the windows."""
        return _shares([answer for _, answer in self.window_grades])


def _shares(answers: Sequence[Impairment | Grade]) -> dict[str, float]:
    names = [f"{a.label} {a.side}" if a.side else a.label for a in answers]
    return {name: names.count(name) / len(names) for name in dict.fromkeys(names)}


def measure_clip(clip: Clip) -> WalkCycles:
    """Measure the cycles of a clip. Its skeleton may be any rig whose joints have roles."""
    return measure_cycles(clip.skeleton, clip.positions, clip.fps)


def healthy_profile(clips: Sequence[Clip]) -> Profile:
    """The profile of all cycles of a figure's healthy clips.

    If no clips are given, it is the mean profile of people's normal walks (people.py). Raises HobbleError if
    no clip has a cycle.
    """
    return (
        profile_of_walk(join_walks(measure_clip(clip) for clip in clips))
        if clips
        else read_people().normal_profile()
    )


def compare_clip(clip: Clip, healthy: Profile, seconds: float = 4.0) -> WalkComparison:
    """Compare a clip with a healthy profile: the whole clip, and each window of `seconds` seconds.

    Raises HobbleError if the clip has no cycle.
    """
    return compare_walk(measure_clip(clip), len(clip), healthy, seconds)


def compare_walk(walk: WalkCycles, frames: int, healthy: Profile, seconds: float = 4.0) -> WalkComparison:
    """Compare the cycles of a motion of `frames` frames with a healthy profile. See `compare_clip`."""
    whole = profile_of_walk(walk)
    window_profiles = [
        (start, profile_of_walk(part)) for start, part in windows_with_cycles(walk, frames, seconds)
    ]
    return WalkComparison(
        walk,
        whole,
        recognise(whole, healthy),
        grade_walk(whole, healthy),
        [(start, recognise(part, healthy)) for start, part in window_profiles],
        [(start, grade_walk(part, healthy)) for start, part in window_profiles],
        {side: measure_effects(whole, healthy, side) for side in SIDES},
    )
