"""Severities of F frames and L links, from a status file or from one status for the whole clip.

A link is the piece of the body between two neighbouring joints. A spell is a range of frames in which some
links hurt, each with a severity from 0 to 10. A status file belongs to a BVH file. Its first line is the
number of frames of the BVH file, and each further line is a spell.
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

FPS = 60.0  # frames a second of every clip, whatever the rate of its BVH file


def severity_matrix(status: Status, links: Sequence[str]) -> Array:
    """(status.frames, L) float32 severities, one row for each frame that `status` counts.

    links: the names of the columns. Where spells overlap, the one that comes later in `status` counts for the
    links that it names.
    """
    out = np.zeros((status.frames, len(links)), np.float32)
    column = {link: i for i, link in enumerate(links)}
    for spell in status.spells:
        for link, severity in spell.links:
            out[max(spell.first, 1) - 1 : spell.last, column[link]] = severity
    return out


def range_warnings(status: Status, path: str | Path) -> list[str]:
    """A warning for each range that starts at 0, goes past the last frame or contradicts an earlier line.

    status: the content of the status file `path`.
    """
    warnings = []
    overlaps = _overlaps(status.spells)
    for i, spell in enumerate(status.spells):
        place = f"{Path(path).name}, line {spell.line}: the range {spell.first}-{spell.last}"
        if spell.first > status.frames:
            warnings.append(f"{place} lies past the last frame ({status.frames}) and was ignored.")
        elif spell.last > status.frames:
            warnings.append(f"{place} goes past the last frame ({status.frames}) and was cut there.")
        if spell.first == 0:
            warnings.append(f"{place} starts at 0. Frames count from 1, so it was taken to start at 1.")
        for earlier in overlaps.get(i, ()):
            if links := _conflicting_links(earlier, spell):
                warnings.append(
                    f"{place} overlaps the range of line {earlier.line}. The later line counts for {links}."
                )
    return warnings


def _overlaps(spells: Sequence[InjurySpell]) -> dict[int, list[InjurySpell]]:
    """Index of a spell -> the spells before it in the list that share frames with it, in their order."""
    found: dict[int, list[int]] = {}  # index of a spell -> indices of such spells
    lasting: list[int] = []  # indices of spells that last at the first frame of spell i
    for i in sorted(range(len(spells)), key=lambda i: spells[i].first):
        lasting = [j for j in lasting if spells[j].last >= spells[i].first]
        for j in lasting:
            found.setdefault(max(i, j), []).append(min(i, j))
        lasting.append(i)
    return {i: [spells[j] for j in sorted(others)] for i, others in found.items()}


def _conflicting_links(earlier: InjurySpell, later: InjurySpell) -> str:
    """The links for which two overlapping spells give different severities, separated by commas."""
    earlier_values = dict(earlier.links)
    return ", ".join(link for link, severity in later.links if earlier_values.get(link, severity) != severity)


def clip_severity(
    clip: Clip, status_file: str | Path | None, status: str | None, motion_report: Mapping[str, Any]
) -> tuple[Array, list[str]]:
    """Severities (F, L) float32 of a clip, and warnings.

    status_file: the file beside the clip's BVH file. status: severities for all frames ("A-B[4];C-D[8]"). If
    it is given, the file is not read. If both are None, all severities are 0. motion_report: how the clip was
    made from its BVH file. It needs the keys that `source_rows` names, `source` (name of the BVH file) and
    `source_frames` (its number of frames).

    Raises InputError if the status or its file cannot be read, or if the first line of the status file
    differs from the number of frames of the BVH file. A difference of one frame is only a warning.
    """
    links = clip.skeleton.link_names
    if not links:  # without links there are no columns, so the status is not read
        return np.zeros((len(clip), 0), np.float32), []
    if status is not None:
        where = f"status of {clip.name} in the data set's configuration"
        whole_clip = InjurySpell(1, len(clip), parse_links(status, links, where))
        return severity_matrix(Status(len(clip), (whole_clip,)), links), []
    if status_file is None:
        return np.zeros((len(clip), len(links)), np.float32), []
    file_status = read_status(status_file, links)
    in_source = f"{motion_report['source']} has {motion_report['source_frames']}"
    if abs(file_status.frames - motion_report["source_frames"]) > 1:
        raise InputError(
            status_file,
            f"counts {file_status.frames} frames, but {in_source}",
            line=1,
            fix="Write the number of frames of the BVH file, at its own rate, and check the ranges.",
        )
    warnings = range_warnings(file_status, status_file)
    if file_status.frames != motion_report["source_frames"]:
        warnings.insert(
            0,
            f"{Path(status_file).name}, line 1: counts {file_status.frames} frames, but "
            f"{in_source}. The ranges were used unchanged. Check that the status file belongs to this clip.",
        )
    rows = severity_matrix(file_status, links)
    return rows[source_rows(len(clip), file_status.frames, motion_report)], warnings


def source_rows(frames: int, source_frames: int, motion_report: Mapping[str, Any]) -> Array:
    """(frames,) index, from 0, of the frame of the BVH file (the source) that each frame of a clip shows.

    frames: number of frames of the clip. source_frames: number of frames that the status file counts in the
    source. motion_report: how the clip was made from its source.

    Keys of motion_report. source_fps: frames a second of the source. source_start: first frame of the source
    that was used, from 0. cycle_frames: number of frames after which the clip repeats; the length of the clip
    if it does not repeat.
    """
    frame_in_cycle = np.arange(frames) % motion_report.get("cycle_frames", frames)
    source_frame = frame_in_cycle * (motion_report["source_fps"] / FPS) + motion_report.get("source_start", 0)
    # 1e-6 keeps rounding errors from moving a whole number to the frame before it.
    return np.clip(np.floor(source_frame + 1e-6).astype(int), 0, source_frames - 1)


def mirror_severity(severity: Array, mirror_links: Array) -> Array:
    """Severities (F, L) of the mirrored clip: left and right swapped.

    mirror_links: (L,) for each link, the index of the link on the other side of the body.
    """
    return np.ascontiguousarray(severity[:, mirror_links])
