"""Decides which frame of the healthy clip (the source) each frame of the hurt clip shows.

The body and each leg have times of their own, because a hurt foot lands and leaves the ground at other phases
of the cycle. New frames are the frames of the hurt clip.
The labels move with the frames.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import PchipInterpolator

from hobble.core.quat import Array
from hobble.core.smooth import smoothstep
from hobble.hurt.effects import LEFT, RIGHT, Effects
from hobble.hurt.healthy_clip import HealthyClip, interpolate_values
from hobble.labels.clip_labels import Labels
from hobble.labels.phase import dropped_frames, find_cycles, phase_of_footsteps

# The time between two successive events (such as landing and leaving) shrinks at most to this share.
LEAST_SHARE = 0.57
# A jog gets only this share of a change of stride time, because gravity sets how long its flight lasts.
JOG_STRIDE = 0.15
JOG_SHIFT = 0.7  # a jog gets only this share of the shifts of landing and leaving, as its stances are short
# Steps to a side or backward, and in turns of TURN radians a second or more, get ASIDE_SHIFT: a foot that
# hardly rolls off hides a limp. Crouched steps and those on a slope of STEEP or more get LOW_SHIFT, since a
# network sees few of them, and learns less of their limp.
ASIDE_SHIFT, TURN, LOW_SHIFT, STEEP = 1.4, 1.0, 1.7, 0.12
# While the hurt foot stands, the body hurries less than the sound foot, which so lands further ahead of the
# hips. The path gets this share of an early landing.
PATH_SHARE = 0.5
MOST_SHIFT = 0.3  # cycles: shifts of landing and leaving stay below this


@dataclass(frozen=True)
class Timing:
    """Which of F source frames is shown in each of N new frames. Frames have fractions.

    body_frames: (N,) source frame that the body shows in each new frame. path_frames: (N,) the one in whose
    place on the path the body is. leg_frames: (N, 2) the same as `body_frames` for the left and the right
    leg. stride_ratio: (F,) new duration of a stride / old duration.
    """

    body_frames: Array = field(repr=False)
    path_frames: Array = field(repr=False)
    leg_frames: Array = field(repr=False)
    stride_ratio: Array = field(repr=False)


def retime(source: HealthyClip, effects: Effects, slope: Array) -> Timing:
    """Slow the cadence, and shift each foot's landing and leaving within the cycle, as `effects` says.

    slope: (F,) of the ground, as a share of the way.
    """
    stride_ratio = 1 + effects.changes["stride"] * (1 - (1 - JOG_STRIDE) * source.jog_share)
    # The new frame that would show each source frame if no landing or leaving was shifted.
    cadence_times = np.concatenate([[0.0], np.cumsum((stride_ratio[1:] + stride_ratio[:-1]) / 2)])
    new_cycle = source.cycle_frames * stride_ratio
    new = np.arange(int(cadence_times[-1] + 1e-6) + 1, dtype=float)
    legs, landings = [], []
    shares = 1 - (1 - JOG_SHIFT) * source.jog_share
    turning = np.abs(np.gradient(np.unwrap(2 * np.arctan2(source.heading[:, 2], source.heading[:, 0]))))
    aside = np.maximum(source.aside, smoothstep(turning * source.clip.fps / TURN))
    low = np.maximum(source.low, smoothstep(slope / STEEP))
    shares *= 1 + np.maximum((ASIDE_SHIFT - 1) * aside, (LOW_SHIFT - 1) * low)
    for side in (LEFT, RIGHT):
        # Delays in new frames, for each source frame. Shifts stay below MOST_SHIFT.
        land, off = (
            MOST_SHIFT * np.tanh(effects.changes[name][:, side] / MOST_SHIFT) * shares * new_cycle
            for name in ("land", "off")
        )
        events = [event for s in source.stances[side] for event in ((s.land, land), (s.off, off))]
        # The first landing and the last leaving are the ends of the clip. So they are not shifted.
        shifted = [(at, float(delay[at])) for at, delay in events[1:-1]]
        landings += shifted[1::2]
        legs.append(_source_frames(shifted, cadence_times, new))
    landings.sort()
    body = _source_frames(landings, cadence_times, new)
    path = _source_frames(
        [(at, max(delay, PATH_SHARE * delay)) for at, delay in landings], cadence_times, new
    )
    return Timing(body, path, np.stack(legs, axis=1), stride_ratio)


def _source_frames(events: list[tuple[int, float]], cadence_times: Array, new: Array) -> Array:
    """(N,) the source frame that is shown in each of the N frames `new`.

    events: (source frame, delay in new frames), in order. cadence_times: (F,) the new frame of each source
    frame without these delays. Between two events the time is interpolated smoothly.
    """
    last = len(cadence_times) - 1
    # `at[i]` is the source frame of an event, `goal[i]` the new frame that shows it.
    at, goal = [0], [0.0]
    for when, delay in events:
        if at[-1] < when < last:
            at.append(when)
            goal.append(float(cadence_times[when]) + delay)
    at.append(last)
    goal.append(float(cadence_times[last]))
    # Two passes, forwards and backwards, keep the events at least these gaps apart.
    least_gaps = LEAST_SHARE * np.diff(cadence_times[at])
    for i, gap in enumerate(least_gaps[:-1]):
        goal[i + 1] = max(goal[i + 1], goal[i] + gap)
    for i in range(len(at) - 2, 0, -1):
        goal[i] = min(goal[i], goal[i + 1] - least_gaps[i])
    return np.clip(PchipInterpolator(goal, at)(new), 0.0, last)


# Moves the labels of the healthy clip to the times of the hurt clip, whose steps are slower and uneven.


def relabel(labels: Labels, timing: Timing, zero: str, margins: str) -> Labels:
    """The labels of the hurt clip. A limping walk still has the gait "walk".

    labels: of the healthy clip. timing: which of its frames the hurt clip shows, and when. zero: the foot
    that lands at phase 0, "left" or "right". margins: which cycles are used, a key of MARGINS in
    `hobble.labels.phase`.
    """
    frames = len(timing.body_frames)
    last = len(labels) - 1
    nearest = [np.clip(np.round(timing.leg_frames[:, side]).astype(int), 0, last) for side in (LEFT, RIGHT)]
    # Columns of contacts: left heel, left toe, right heel, right toe. So `column // 2` is the side.
    contacts = np.stack([labels.contacts[nearest[column // 2], column] for column in range(4)], axis=1)
    footsteps = labels.footsteps.copy()  # a row holds a right landing, a left landing and a mark
    for column, side in ((0, RIGHT), (1, LEFT)):
        footsteps[:, column] = np.interp(footsteps[:, column], timing.leg_frames[:, side], np.arange(frames))
    phase, known = phase_of_footsteps(footsteps, frames)
    known &= ~dropped_frames(footsteps, frames)
    body = np.clip(np.round(timing.body_frames).astype(int), 0, last)
    cycles, _ = find_cycles(footsteps, frames, zero, margins)
    return Labels(
        contacts=contacts,
        phase=phase if zero == "right" else (phase + 0.5) % 1.0,
        phase_known=known & labels.phase_known[body],
        gait=interpolate_values(labels.gait, timing.body_frames),
        footsteps=footsteps,
        cycles=cycles,
    )
