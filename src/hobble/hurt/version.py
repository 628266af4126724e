"""Makes a hurt version of a clip in a data set: decides which links hurt, when, and at which severities.

A link is the bone between two joints. The links are dealt like cards from a deck that holds all links. Links
with large effects are in it several times.
"""

import itertools
import math
import zlib
from dataclasses import replace

import numpy as np

from hobble.channels.guarding import guarding_of_clip
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.hurt import Hurt
from hobble.hurt.effects import part_of_link
from hobble.hurt.hurt_clip import HurtClip, hurt_clip
from hobble.labels.clip_labels import LabelReport, Labels
from hobble.labels.label_files import whole_frame
from hobble.labels.phase import find_cycles

# Part of the body -> number of cards of each of its links. Links of other parts have one card.
CARDS_OF_PART = {"hip": 3, "thigh": 5, "shank": 5, "foot": 5, "back": 2}
FURTHER_LINKS = 0.25  # share of the stretches in which further links hurt as well, if `at_once` allows it
# Share of the stretches in which an arm hurts as well, if `at_once` allows it. People swing their arms in
# very different ways. If few people in the data have a hurt arm, a network takes the way in which these few
# swing their arms for an effect of the injury. An injury of an arm hardly changes the legs. So a network can
# learn an injury of an arm and another injury from the same stretch.
ARM_TOO = 0.6
ARMS = ("upper arm", "forearm")
# A stretch of fewer seconds has one severity instead of two. With two, hardly a whole gait cycle would have
# the same severity from start to end, and a network would learn nearly the same limp for both.
SECONDS_FOR_TWO = 4.0
# A clip is divided into equal stretches of about the option `seconds`. If the frames left after whole
# stretches of `seconds` last at least this share of `seconds`, there is one stretch more.
LEAST_REST = 0.4
GUARDING_CHANGE_SECONDS = 1.0  # time in which a body that guards begins to guard more, or less


def schedule_severities(
    skeleton: Skeleton, frames: int, fps: float, options: Hurt, clip: str, version_number: int
) -> Array:
    """(frames, L) severities, 0 to 10, of the L links in a hurt version of `frames` frames.

    clip: name of the hurt version. version_number: its number among all versions of the data set, from 0.

    The version is divided into stretches. In each stretch the link of the next card hurts. For half of the
    stretch it has the highest severity, because a network learns most from it, for the other half another
    one. In a short stretch it has only one of the two. All versions of a data set use the same deck, and a
    version of a clip goes on where the one before it stopped. So all cards are used about equally often in
    the versions of one clip, too. `clip` and the option `seed` decide which links hurt besides, and at which
    severities. Raises HobbleError for an unknown link.
    """
    rng = np.random.default_rng([options.seed, zlib.crc32(clip.encode())])
    deck = _make_deck(skeleton, options)
    arms = [link for link in deck if part_of_link(skeleton, skeleton.links[link]).name in ARMS]
    out = np.zeros((frames, len(skeleton.links)), np.float32)
    highest = max(options.severities)
    lower_severities = sorted(set(options.severities) - {highest}) or [highest]
    stretches = _stretch_count(frames, options.seconds * fps)
    edges = np.round(np.linspace(0, frames, 1 + stretches)).astype(int)
    for i, (begin, end) in enumerate(itertools.pairwise(edges.tolist())):
        hurt = [deck[(version_number * stretches + i) % len(deck)]]
        if options.at_once > 1 and rng.random() < FURTHER_LINKS:
            hurt += rng.permutation(deck)[: rng.integers(1, options.at_once)].tolist()
        if arms and len(hurt) < options.at_once and rng.random() < ARM_TOO:
            hurt.append(int(rng.choice(arms)))
        half = (begin + end) // 2
        if end - begin < SECONDS_FOR_TWO * fps:
            half = int(rng.choice([begin, end]))  # the whole stretch is the second half, or the first
        for link in hurt:
            out[begin:half, link], out[half:end, link] = rng.permutation(
                [highest, rng.choice(lower_severities)]
            )
    return out


def schedule_guarding(frames: int, fps: float, options: Hurt, clip: str) -> tuple[Array, Array]:
    """How much the body guards in a hurt version: frames (K,), and the values (K,), 0 to 1, in these frames.

    Between these frames the value changes evenly. The values in the two halves of a stretch add up to 1, so a
    network sees every link with much and with little guarding.
    """
    stretches = _stretch_count(frames, options.seconds * fps)
    edges = np.linspace(0, frames, 1 + 2 * stretches)
    pause = min(0.5 * GUARDING_CHANGE_SECONDS * fps, 0.25 * edges[1])
    knots = np.stack([edges[:-1] + pause, edges[1:] - pause], axis=1)
    values = np.array([guarding_of_clip(clip, i) for i in range(stretches)])
    return knots.ravel(), np.repeat(np.stack([values, 1.0 - values], axis=1), 2)


def _make_deck(skeleton: Skeleton, options: Hurt) -> list[int]:
    """The cards of the data set: indices of links. The cards of a link are spread evenly over the deck."""
    names = list(skeleton.link_names)
    if unknown := [link for link in options.links if link not in names]:
        there = f"Its links are {', '.join(names)}."
        raise HobbleError(f"hurt.links: skeleton {skeleton.name} has no link {', '.join(unknown)}. {there}")
    rng = np.random.default_rng(options.seed)
    places: list[tuple[float, int]] = []  # place in the deck, 0 to 1, and link
    for i in (names.index(link) for link in options.links or names):
        count = CARDS_OF_PART.get(part_of_link(skeleton, skeleton.links[i]).name, 1)
        places += [((rng.random() / count + n / count), i) for n in range(count)]
    return [i for _, i in sorted(places)]


def _stretch_count(frames: int, length: float) -> int:
    """Into how many stretches of about `length` frames a version of `frames` frames is divided."""
    return max(1, math.floor(frames / length + 1 - LEAST_REST))


SEVERITY_TOLERANCE = 0.5  # a severity counts as a requested severity if they differ by at most this
# The versions of clips shorter than this are not cut off, because they might lose all gait cycles.
UNCUT_SECONDS = 6.0


def hurt_version(
    clip: Clip,
    labels: Labels,
    report: LabelReport,
    options: Hurt,
    *,
    name: str,
    version_number: int,
    ground: str,
) -> tuple[HurtClip, LabelReport, list[list[float]]]:
    """Make a hurt version of a healthy clip.

    Returns the version, the report of its labels, and the course of its guarding: frames, and values between
    which it changes.

    labels, report: of the healthy clip. name: of the version. version_number: its number among all versions
    of the data set, from 0. ground: "flat", or another kind of ground.
    """
    severity = schedule_severities(clip.skeleton, len(clip), clip.fps, options, name, version_number)
    knots, values = schedule_guarding(len(clip), clip.fps, options, name)
    flat, guarding = ground == "flat", np.interp(np.arange(len(clip)), knots, values)
    hurt = hurt_clip(clip, labels, severity, name, flat, report.phase_zero, report.margins, guarding)
    frames = len(hurt.clip)
    unused = np.zeros(frames, bool)
    if not options.in_between:
        allowed = np.array([0.0, *options.severities])
        away = np.abs(hurt.severity[..., None] - allowed).min(axis=-1)
        unused = (away > SEVERITY_TOLERANCE).any(axis=1)
    if len(clip) >= UNCUT_SECONDS * clip.fps:
        unused |= np.arange(frames) >= options.longest * len(clip)
    course = [np.searchsorted(hurt.source_frames, knots).tolist(), values.round(3).tolist()]
    return *leave_out(hurt, unused, replace(report, clip=name)), course


def leave_out(hurt: HurtClip, unused: np.ndarray, report: LabelReport) -> tuple[HurtClip, LabelReport]:
    """Leave out the cycles with frames that are `unused`, (N,) bool. Returns the clip and the report.

    The frames stay, but the labels no longer list these cycles. Their footsteps are marked as unused, so that
    the labels of the mirrored clip lack these cycles, too. Such a mark may also leave out the cycle before
    (see `hobble.labels.phase`).
    """
    footsteps = hurt.labels.footsteps.copy()  # a row holds a right landing, a left landing and a mark
    for row, following in itertools.pairwise(footsteps):
        if np.isfinite(row[0]) and np.isfinite(following[0]):
            row[2] = max(row[2], float(unused[whole_frame(row[0]) : whole_frame(following[0]) + 1].any()))
    cycles, dropped = find_cycles(footsteps, len(hurt.clip), report.phase_zero, report.margins)
    labels = replace(hurt.labels, footsteps=footsteps, cycles=cycles)
    return replace(hurt, labels=labels), replace(report, cycles_dropped=dropped)
