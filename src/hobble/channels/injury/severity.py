"""Severities: frames x links, from a status file or from what a data set says hurts all the while."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels.injury.status import Spell, Status, parse_links, read_status
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array

FPS = 60.0  # of every clip


def severity_matrix(status: Status, links: Sequence[str]) -> Array:
    """(status.frames, L) float32 severities, one row for each frame of the clip's file."""
    out = np.zeros((status.frames, len(links)), np.float32)
    column = {link: i for i, link in enumerate(links)}
    for spell in status.spells:
        for link, severity in spell.links:
            out[max(spell.first, 1) - 1 : spell.last, column[link]] = severity
    return out


def odd_ranges(status: Status, path: str | Path) -> list[str]:
    """A sentence for each range that starts at 0, leaves the clip, or changes what an earlier line says."""
    said = []
    overlaps = _overlaps(status.spells)
    for i, spell in enumerate(status.spells):
        place = f"{Path(path).name}, line {spell.line}: the range {spell.first}-{spell.last}"
        if spell.first > status.frames:
            said.append(f"{place} lies past the last of {status.frames} frames and says nothing.")
        elif spell.last > status.frames:
            said.append(f"{place} goes past the last of {status.frames} frames; it was cut there.")
        if spell.first == 0:
            said.append(f"{place} starts at 0; frames count from 1, so it was taken to start there.")
        for earlier in overlaps.get(i, ()):
            if both := _contested(earlier, spell):
                said.append(f"{place} overlaps that of line {earlier.line}; the later one counts for {both}.")
    return said


def _overlaps(spells: Sequence[Spell]) -> dict[int, list[Spell]]:
    """For each spell the earlier ones that share frames with it, in their order."""
    found: dict[int, list[int]] = {}
    going: list[int] = []
    for i in sorted(range(len(spells)), key=lambda i: spells[i].first):
        going = [j for j in going if spells[j].last >= spells[i].first]
        for j in going:
            found.setdefault(max(i, j), []).append(min(i, j))
        going.append(i)
    return {i: [spells[j] for j in sorted(others)] for i, others in found.items()}


def _contested(earlier: Spell, later: Spell) -> str:
    """The links of which two spells that share frames say different things, with commas between."""
    said = dict(earlier.links)
    return ", ".join(link for link, severity in later.links if said.get(link, severity) != severity)


def clip_severity(
    clip: Clip, status_file: str | Path | None, status: str | None, motion: Mapping[str, Any]
) -> tuple[Array, list[str]]:
    """Severities (F, L) float32 of a clip, and warnings.

    status_file: the file beside the clip. status: instead of it, what hurts in all frames ("A-B[4];C-D[8]").
    motion: the report of the motion stage, for `source_frames` and `source_fps`.
    Raises InputError where either cannot be read or the file counts other frames than the clip's; one more or
    less is a warning.
    """
    links = clip.skeleton.link_names
    if not links:  # a figure that nobody said where to hurt: there is no column to fill
        return np.zeros((len(clip), 0), np.float32), []
    if status is not None:
        where = f"status of {clip.name} in the data set's configuration"
        everywhere = Spell(1, len(clip), parse_links(status, links, where))
        return severity_matrix(Status(len(clip), (everywhere,)), links), []
    if status_file is None:
        return np.zeros((len(clip), len(links)), np.float32), []
    read = read_status(status_file, links)
    if abs(read.frames - motion["source_frames"]) > 1:
        raise InputError(
            status_file,
            f"counts {read.frames} frames, but {motion['source']} has {motion['source_frames']}",
            line=1,
            fix="Count the frames of the file, at its own rate, and check the ranges.",
        )
    said = odd_ranges(read, status_file)
    if read.frames != motion["source_frames"]:
        said.insert(
            0,
            f"{Path(status_file).name}, line 1: counts {read.frames} frames, but {motion['source']} has "
            f"{motion['source_frames']}; the ranges were taken as they stand. Is it the file of this clip?",
        )
    rows = severity_matrix(read, links)
    return rows[source_rows(len(clip), read.frames, motion)], said


def source_rows(frames: int, rows: int, motion: Mapping[str, Any]) -> Array:
    """(frames,) for each frame of a clip the row, from 0, of the source frame that shows at its moment."""
    once = np.arange(frames) % motion.get("cycle_frames", frames)  # a looped clip comes back to its beginning
    at = once * (motion["source_fps"] / FPS) + motion.get("source_start", 0)
    return np.clip(np.floor(at + 1e-6).astype(int), 0, rows - 1)


def mirror_severity(severity: Array, mirror_links: Array) -> Array:
    """Severities (F, L) of the mirrored clip: what hurt on the left hurts on the right."""
    return np.ascontiguousarray(severity[:, mirror_links])
