"""Chooses the clips that the page shows one by one, so that its size does not grow with the data set."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from hobble.measures.stratified_sample import shuffle_key
from hobble.report.gather import ReportMaterial

MOST_SHOWN = 150  # at most this many clips have label curves, a row in the table and views of their ground
MOST_COUNTED = 600  # at most this many clips are read to count how many seconds of data there are


def choose_clips(material: ReportMaterial, most: int = MOST_SHOWN) -> frozenset[str]:
    """Names of the clips that the page shows: all clips, or `most` of them if there are more.

    The clips are divided into kinds by split, by main gait, and by whether a channel (group of inputs of the
    network) is above 0 in them. In each round every kind gives one clip, until there are `most`. Which clip
    of its kind comes first is random, but depends only on the names.
    """
    with_values = {report["clip"] for report in material.channels if report.get("values")}
    kinds: dict[tuple[str, str, bool], list[str]] = {}
    for report in material.labels:
        clip, seconds = report["clip"], report.get("seconds") or {}
        gait = max(seconds, key=lambda name: seconds[name], default="")
        kinds.setdefault((material.split_of(clip), gait, clip in with_values), []).append(clip)
    if sum(map(len, kinds.values())) <= most:
        return frozenset(name for names in kinds.values() for name in names)
    candidates = [
        (turn, kind, name) for kind in kinds for turn, name in enumerate(sorted(kinds[kind], key=shuffle_key))
    ]
    return frozenset(name for *_, name in sorted(candidates)[:most])


def sample_files(paths: Sequence[str], most: int = MOST_COUNTED) -> list[str]:
    """At most `most` of the paths, drawn at random. paths: one file for each clip, called after the clip.

    The draw depends only on the names, so it is the same each time.
    """
    if len(paths) <= most:
        return list(paths)
    chosen = set(sorted((Path(path).stem for path in paths), key=shuffle_key)[:most])
    return [path for path in paths if Path(path).stem in chosen]


def files_of_clips(paths: Iterable[str], names: frozenset[str]) -> list[str]:
    """Those of the paths that belong to the clips `names`. paths: files called after their clips."""
    return [path for path in paths if Path(path).stem in names]
