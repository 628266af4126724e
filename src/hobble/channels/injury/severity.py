"""Severities of F frames and L links, from a status file or from a status for the whole clip.

A link is the piece of the body between two neighbouring joints. A spell is a range of frames in which some
links hurt. After its first line, a status file has a line for each spell.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels.injury.status import InjurySpell, Status, parse_links, read_status
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array

FPS = 60.0  # frame rate of every clip


def severity_matrix(status: Status, links: Sequence[str]) -> Array:
    """(status.frames, L) float32 severities, one row for each frame of the clip's file.

    Where spells overlap, the one that comes later in `status` counts for the links that it names.
    """
    out = np.zeros((status.frames, len(links)), np.float32)
    column = {link: i for i, link in enumerate(links)}
    for spell in status.spells:
        for link, severity in spell.links:
            out[max(spell.first, 1) - 1 : spell.last, column[link]] = severity
    return out


def range_warnings(status: Status, path: str | Path) -> list[str]:
    """A warning for each range that starts at 0, goes past the clip's end or contradicts an earlier line.

    status: the content of the status file `path`.
    """
    notes = []
    overlaps = _overlaps(status.spells)
    for i, spell in enumerate(status.spells):
        place = f"{Path(path).name}, line {spell.line}: the range {spell.first}-{spell.last}"
        if spell.first > status.frames:
            notes.append(f"{place} lies past the last of {status.frames} frames and was ignored.")
        elif spell.last > status.frames:
            notes.append(f"{place} goes past the last of {status.frames} frames; it was cut there.")
        if spell.first == 0:
            notes.append(f"{place} starts at 0; frames count from 1, so it was taken to start at 1.")
        for earlier in overlaps.get(i, ()):
            if links := _contested(earlier, spell):
                notes.append(
                    f"{place} overlaps that of line {earlier.line}; the later line counts for {links}."
                )
    return notes


def _overlaps(spells: Sequence[InjurySpell]) -> dict[int, list[InjurySpell]]:
    """Index of a spell -> the spells before it in the list that share frames with it, in order."""
    found: dict[int, list[int]] = {}
    lasting: list[int] = []  # spells that have begun and may not have ended
    for i in sorted(range(len(spells)), key=lambda i: spells[i].first):
        lasting = [j for j in lasting if spells[j].last >= spells[i].first]
        for j in lasting:
            found.setdefault(max(i, j), []).append(min(i, j))
        lasting.append(i)
    return {i: [spells[j] for j in sorted(others)] for i, others in found.items()}


def _contested(earlier: InjurySpell, later: InjurySpell) -> str:
    """The links for which two overlapping spells give different severities, separated by commas."""
    earlier_values = dict(earlier.links)
    return ", ".join(link for link, severity in later.links if earlier_values.get(link, severity) != severity)


def clip_severity(
    clip: Clip, status_file: str | Path | None, status: str | None, motion: Mapping[str, Any]
) -> tuple[Array, list[str]]:
    """Severities (F, L) float32 of a clip, and warnings.

    status_file: the file beside the clip. status: severities for all frames ("A-B[4];C-D[8]"), used instead
    of the file. motion: the report of the motion stage, which tells how the clip was made from its BVH file.

    Raises InputError if the status or its file cannot be read, or if the status file states another number of
    frames than the clip's file has. A difference of one frame is only a warning.
    """
    links = clip.skeleton.link_names
    if not links:  # the skeleton has no links, so there are no columns
        return np.zeros((len(clip), 0), np.float32), []
    if status is not None:
        where = f"status of {clip.name} in the data set's configuration"
        everywhere = InjurySpell(1, len(clip), parse_links(status, links, where))
        return severity_matrix(Status(len(clip), (everywhere,)), links), []
    if status_file is None:
        return np.zeros((len(clip), len(links)), np.float32), []
    read = read_status(status_file, links)
    if abs(read.frames - motion["source_frames"]) > 1:
        raise InputError(
            status_file,
            f"counts {read.frames} frames, but {motion['source']} has {motion['source_frames']}",
            line=1,
            fix="Count the frames of the BVH file, at its own rate, and check the ranges.",
        )
    warnings = range_warnings(read, status_file)
    if read.frames != motion["source_frames"]:
        warnings.insert(
            0,
            f"{Path(status_file).name}, line 1: counts {read.frames} frames, but {motion['source']} has "
            f"{motion['source_frames']}; the ranges were taken as they stand. Is it the file of this clip?",
        )
    rows = severity_matrix(read, links)
    return rows[source_rows(len(clip), read.frames, motion)], warnings


def source_rows(frames: int, rows: int, motion: Mapping[str, Any]) -> Array:
    """(frames,) index, from 0, of the source frame that each frame of a clip shows.

    frames: number of frames of the clip. rows: number of frames of the source. motion: the report of the
    motion stage, which tells how the clip was made from its source.
    """
    in_cycle = np.arange(frames) % motion.get("cycle_frames", frames)  # a looped clip repeats its source
    source_frame = in_cycle * (motion["source_fps"] / FPS) + motion.get("source_start", 0)
    return np.clip(np.floor(source_frame + 1e-6).astype(int), 0, rows - 1)


def mirror_severity(severity: Array, mirror_links: Array) -> Array:
    """Severities (F, L) of the mirrored clip: left and right swapped.

    mirror_links: (L,) for each link, the index of the link on the other side of the body.
    """
    return np.ascontiguousarray(severity[:, mirror_links])
