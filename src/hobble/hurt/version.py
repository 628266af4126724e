"""Makes a hurt version of a clip in a data set: decides which links hurt, when, and at which severities.

A link is the bone between two joints. The links are dealt like cards: a card is a link with two severities,
and the deck holds the cards of all links. Links with large effects have several cards.
"""

from __future__ import annotations

import itertools
import math
import zlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hobble.channels.guarding import guarding_of_clip
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.hurt.effects import part_of_link
from hobble.hurt.hurt_clip import HurtClip, hurt_clip
from hobble.hurt.options import Hurt
from hobble.labels.clip_labels import LabelReport, Labels
from hobble.labels.label_files import whole_frame
from hobble.labels.phase import find_cycles

# Part of the body -> number of cards of each of its links. Links of other parts have one card.
CARDS_OF_PART = {"hip": 3, "thigh": 3, "shank": 3, "foot": 3, "back": 2, "upper arm": 2, "forearm": 2}
GOLDEN = (math.sqrt(5) - 1) / 2  # its multiples, modulo 1, spread evenly over 0..1
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


def schedule_severities(
    skeleton: Skeleton, frames: int, fps: float, options: Hurt, clip: str, version_number: int
) -> Array:
    """(frames, L) severities, 0 to 10, of the L links in a hurt version of `frames` frames.

    clip: name of the hurt version. version_number: its number among all versions of the data set, from 0.

    The version is divided into stretches. In each stretch the link of the next card hurts, at one severity in
    the first half and at another in the second half. In a short stretch it has only one of the two. All
    versions of a data set use the same deck. `version_number` decides with which card a version begins, so
    that all cards are used about equally often. `clip` and the option `seed` decide which links hurt besides,
    and which severity a short stretch has. Raises HobbleError for an unknown link.
    """
    rng = np.random.default_rng([options.seed, zlib.crc32(clip.encode())])
    deck = _make_deck(skeleton, options)
    arms = [card for card in deck if part_of_link(skeleton, skeleton.links[card[0]]).name in ARMS]
    out = np.zeros((frames, len(skeleton.links)), np.float32)
    highest = max(options.severities)
    lower_severities = sorted(set(options.severities) - {highest}) or [highest]
    first = int(math.modf((version_number + 1) * GOLDEN)[0] * len(deck))
    begin = 0
    for i, length in enumerate(_stretch_lengths(frames, options.seconds * fps)):
        hurt = [deck[(first + i) % len(deck)]]
        if options.at_once > 1 and rng.random() < FURTHER_LINKS:
            hurt += [deck[j] for j in rng.permutation(len(deck))[: rng.integers(1, options.at_once)]]
        if arms and len(hurt) < options.at_once and rng.random() < ARM_TOO:
            # The lower severity is drawn anew each time, because the cards of an arm do not have all of them.
            # A network that never saw an arm at 5 held it there almost as still as at 10.
            link, first_half, _ = arms[rng.integers(len(arms))]
            lower = float(rng.choice(lower_severities))
            hurt += [(link, highest, lower) if first_half == highest else (link, lower, highest)]
        if length < SECONDS_FOR_TWO * fps:
            half = begin + length * int(rng.integers(2))  # the whole stretch is the first half, or the second
        else:
            half = begin + length // 2
        # Backwards: if two cards have the same link, the first card counts.
        for link, first_half, second_half in hurt[::-1]:
            out[begin:half, link] = first_half
            out[half : begin + length, link] = second_half
        begin += length
    return out


def _make_deck(skeleton: Skeleton, options: Hurt) -> list[tuple[int, float, float]]:
    """The cards of the data set: (index of a link, severity in the first half, severity in the second half).

    One of the two severities is the highest, because a network learns most from it. For the other severity,
    the cards of a link take turns with the remaining severities.
    """
    names = list(skeleton.link_names)
    if unknown := [link for link in options.links if link not in names]:
        raise HobbleError(
            f"hurt.links: skeleton {skeleton.name} has no link {', '.join(unknown)}. "
            f"Its links are {', '.join(names)}."
        )
    links = [names.index(link) for link in options.links] if options.links else list(range(len(names)))
    rng = np.random.default_rng(options.seed)
    # (place in the deck, 0 to 1; index of the link; severities in the first and in the second half)
    cards: list[tuple[float, int, tuple[float, float]]] = []
    for i in links:
        count = CARDS_OF_PART.get(part_of_link(skeleton, skeleton.links[i]).name, 1)
        values = sorted(options.severities, reverse=True)
        others = [values[j] for j in 1 + rng.permutation(len(values) - 1)] or values
        start = rng.random()
        for n in range(count):
            pair = (values[0], others[n % len(others)])
            # The cards of a link are spread over the deck, so that a clip does not get only this link.
            cards.append((math.modf(start + n / count)[0], i, pair if n % 2 == 0 else pair[::-1]))
    return [(i, *pair) for _, i, pair in sorted(cards)]


def _stretch_lengths(frames: int, length: float) -> list[int]:
    """Divide `frames` frames into stretches of about `length` frames. Returns the length of each stretch."""
    count = max(1, math.floor(frames / length + 1 - LEAST_REST))
    edges = np.round(np.linspace(0, frames, count + 1)).astype(int)
    return [int(n) for n in np.diff(edges)]


# Makes a hurt version of a clip in a data set.
#
# It chooses the severities, lets `hobble.hurt.hurt_clip` change the motion, and limits the version's length.


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
) -> tuple[HurtClip, LabelReport]:
    """Make a hurt version of a healthy clip. Returns the version and the report of its labels.

    labels, report: of the healthy clip. name: of the version. version_number: its number among all versions
    of the data set, from 0. ground: "flat", or another kind of ground.
    """
    severity = schedule_severities(clip.skeleton, len(clip), clip.fps, options, name, version_number)
    flat = ground == "flat"
    hurt = hurt_clip(
        clip,
        labels,
        severity,
        name,
        flat=flat,
        zero=report.phase_zero,
        margins=report.margins,
        guarding=guarding_of_clip(name),
    )
    if not options.in_between:
        hurt = leave_out_other_severities(hurt, options.severities, report)
    if len(clip) >= UNCUT_SECONDS * clip.fps:
        hurt = cut_to_length(hurt, round(options.longest * len(clip)), report)
    _, dropped = find_cycles(hurt.labels.footsteps, len(hurt.clip), report.phase_zero, report.margins)
    return hurt, replace(report, clip=name, cycles_dropped=dropped)


def leave_out_other_severities(hurt: HurtClip, severities: Sequence[float], report: LabelReport) -> HurtClip:
    """Leave out the cycles in which the severity of a link is neither 0 nor one of `severities`.

    The frames stay, but the labels no longer list these cycles. Their footsteps are marked as unused, so that
    the labels of the mirrored clip lack these cycles, too. Such a mark may also leave out the cycle before
    (see `hobble.labels.phase`).
    """
    allowed = np.array([0.0, *severities])
    other = (np.abs(hurt.severity[..., None] - allowed).min(axis=-1) > SEVERITY_TOLERANCE).any(axis=1)
    footsteps = hurt.labels.footsteps.copy()  # a row holds a right landing, a left landing and a mark
    for row, following in itertools.pairwise(footsteps):
        if np.isfinite(row[0]) and np.isfinite(following[0]):
            row[2] = max(row[2], float(other[whole_frame(row[0]) : whole_frame(following[0]) + 1].any()))
    cycles, _ = find_cycles(footsteps, len(hurt.clip), report.phase_zero, report.margins)
    return replace(hurt, labels=replace(hurt.labels, footsteps=footsteps, cycles=cycles))


def cut_to_length(hurt: HurtClip, frames: int, report: LabelReport) -> HurtClip:
    """The first `frames` frames of a hurt clip, or the whole clip if it is not longer."""
    if frames >= len(hurt.clip):
        return hurt
    clip, labels = hurt.clip, hurt.labels
    footsteps = labels.footsteps.copy()
    landings = footsteps[:, :2]  # a view, so the next line changes `footsteps`
    landings[landings > frames - 1] = np.nan
    # Drop rows that have lost their landings. Keep rows that had none before: they end bouts of walking.
    ends_bout = np.isnan(labels.footsteps[:, :2]).all(axis=1)
    footsteps = footsteps[ends_bout | ~np.isnan(landings).all(axis=1)]
    cycles, _ = find_cycles(footsteps, frames, report.phase_zero, report.margins)
    cut = {name: getattr(labels, name)[:frames] for name in ("contacts", "phase", "phase_known", "gait")}
    short = replace(labels, **cut, footsteps=footsteps, cycles=cycles)
    part = clip.part(slice(frames))
    return HurtClip(part, hurt.severity[:frames], short, hurt.source_frames[:frames])
