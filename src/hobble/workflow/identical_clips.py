"""Finds clips of a data set that have identical files, before any job runs."""

from __future__ import annotations

from collections import defaultdict
from itertools import combinations
from pathlib import Path

from hobble.database.split_check import refuse_split_pairs
from hobble.workflow.checksums import file_sha256
from hobble.workflow.clips import Clips, original
from hobble.workflow.datasets import Datasets


def find_identical_pairs(clips: Clips, dataset: str) -> list[tuple[str, str, str]]:
    """Each pair of clips with identical files: (name, name, "the same file").

    "the same file" is what a message says about the pair. Only files of equal size are read. Empty files are
    ignored.
    """
    clips_by_size: dict[int, list[tuple[str, Path]]] = defaultdict(list)
    for clip in clips.listed_entries(dataset):
        path = Path(clips.source(dataset, clip))
        if path.is_file() and (size := path.stat().st_size):
            clips_by_size[size].append((clip, path))
    pairs = []
    for files in clips_by_size.values():
        if len(files) > 1:
            hashes = {clip: file_sha256(path) for clip, path in files}
            pairs += [(a, b, "the same file") for a, b in combinations(hashes, 2) if hashes[a] == hashes[b]]
    return pairs


def refuse_copies(clips: Clips, datasets: Datasets, dataset: str, channels: tuple[str, ...]) -> None:
    """Raise HobbleError if a training clip and a held-out clip have identical files.

    dataset: the data set's name. channels: the channels of the network, which decide from which clips it can
    learn. Synthetic data sets are not checked.
    """
    options = datasets.catalogue.dataset(dataset)
    if options.synthetic is None and options.held_out:
        splits = {original(name): split for name, split in datasets.splits(dataset, channels).items()}
        refuse_split_pairs(f"data set {dataset}", find_identical_pairs(clips, dataset), splits)
