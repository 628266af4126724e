"""Finds clips of a data set with identical files before any job runs."""

from __future__ import annotations

from collections import defaultdict
from itertools import combinations
from pathlib import Path

from hobble.database.split_check import refuse_split_pairs
from hobble.workflow.checksums import file_sha256
from hobble.workflow.clips import Clips, original
from hobble.workflow.datasets import Datasets


def same_files(clips: Clips, dataset: str) -> list[tuple[str, str, str]]:
    """Pairs of clips with identical files: (name, name, "the same file"). Reads only files of equal size."""
    sizes: dict[int, list[tuple[str, Path]]] = defaultdict(list)
    for clip in clips.listed(dataset):
        path = Path(clips.source(dataset, clip))
        if path.is_file() and (size := path.stat().st_size):
            sizes[size].append((clip, path))
    out = []
    for files in sizes.values():
        if len(files) > 1:
            digests = {clip: file_sha256(path) for clip, path in files}
            out += [(a, b, "the same file") for a, b in combinations(digests, 2) if digests[a] == digests[b]]
    return out


def refuse_copies(clips: Clips, datasets: Datasets, dataset: str, channels: tuple[str, ...]) -> None:
    """Raise HobbleError if a training clip and a held-out clip have identical files."""
    model = datasets.catalogue.dataset(dataset)
    if model.synthetic is None and model.held_out:
        splits = {original(name): split for name, split in datasets.selected(dataset, channels).items()}
        refuse_split_pairs(f"data set {dataset}", same_files(clips, dataset), splits)
