"""Makes a hurt version of a clip in a data set.

It chooses the severities, lets `hobble.hurt.hurt_clip` change the motion, and limits the version's length.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hobble.core.clip import Clip
from hobble.hurt.hurt_clip import HurtClip, hurt_clip
from hobble.hurt.options import Hurt
from hobble.hurt.schedule import schedule_severities
from hobble.labels.clip_labels import LabelReport, Labels
from hobble.labels.phase import find_cycles
from hobble.labels.read_files import whole_frame

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
    hurt = hurt_clip(clip, labels, severity, name, flat=flat, zero=report.phase_zero, margins=report.margins)
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
    short = Labels(
        labels.contacts[:frames],
        labels.phase[:frames],
        labels.phase_known[:frames],
        labels.gait[:frames],
        footsteps,
        cycles,
    )
    part = Clip(clip.name, clip.skeleton, clip.fps, clip.rotations[:frames], clip.root[:frames])
    return HurtClip(part, hurt.severity[:frames], short, hurt.source_frames[:frames])
