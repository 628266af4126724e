"""Makes a hurt version of a clip in a data set: decides what hurts in it, and limits its length."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hobble.core.clip import Clip
from hobble.hurt.hurt_clip import HurtClip, hurt_clip
from hobble.hurt.options import Hurt
from hobble.hurt.schedule import severities
from hobble.labels.clip_labels import LabelReport, Labels
from hobble.labels.phase import find_cycles
from hobble.labels.read_files import whole_frame

SEVERITY_TOLERANCE = 0.5  # a severity that differs by at most this from a requested one counts as that one
UNCUT_SECONDS = 6.0  # versions of shorter clips are not cut, because they might lose all cycles


def hurt_version(
    clip: Clip, labels: Labels, report: LabelReport, options: Hurt, *, name: str, turn: int, ground: str
) -> tuple[HurtClip, LabelReport]:
    """The version `name` of a healthy clip, and the report of its labels.

    report: of the clip's labels. turn: number of the version among all versions of the data set, from 0.
    ground: "flat", or another kind of ground.
    """
    severity = severities(clip.skeleton, len(clip), clip.fps, options, name, turn)
    flat = ground == "flat"
    hurt = hurt_clip(clip, labels, severity, name, flat=flat, zero=report.phase_zero, margins=report.margins)
    if not options.in_between:
        hurt = settled(hurt, options.severities, report)
    if len(clip) >= UNCUT_SECONDS * clip.fps:
        hurt = cut(hurt, round(options.longest * len(clip)), report)
    _, dropped = find_cycles(hurt.labels.footsteps, len(hurt.clip), report.phase_zero, report.margins)
    return hurt, replace(report, clip=name, cycles_dropped=dropped)


def settled(hurt: HurtClip, severities: Sequence[float], report: LabelReport) -> HurtClip:
    """The clip without the cycles in which the severity of a link is neither 0 nor one of `severities`.

    Their footsteps are marked as unused, so that the mirrored clip lacks these cycles, too.
    """
    settled_values = np.array([0.0, *severities])
    odd = (np.abs(hurt.severity[..., None] - settled_values).min(axis=-1) > SEVERITY_TOLERANCE).any(axis=1)
    footsteps = hurt.labels.footsteps.copy()
    for line, following in itertools.pairwise(footsteps):
        if np.isfinite(line[0]) and np.isfinite(following[0]):
            line[2] = max(line[2], float(odd[whole_frame(line[0]) : whole_frame(following[0]) + 1].any()))
    cycles, _ = find_cycles(footsteps, len(hurt.clip), report.phase_zero, report.margins)
    return replace(hurt, labels=replace(hurt.labels, footsteps=footsteps, cycles=cycles))


def cut(hurt: HurtClip, frames: int, report: LabelReport) -> HurtClip:
    """The first `frames` frames of a hurt clip, or all of it if it has fewer."""
    if frames >= len(hurt.clip):
        return hurt
    clip, labels = hurt.clip, hurt.labels
    footsteps = labels.footsteps.copy()
    steps = footsteps[:, :2]
    steps[steps > frames - 1] = np.nan
    ends = np.isnan(labels.footsteps[:, :2]).all(axis=1)
    footsteps = footsteps[ends | ~np.isnan(steps).all(axis=1)]
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
    return HurtClip(part, hurt.severity[:frames], short, hurt.when[:frames])
