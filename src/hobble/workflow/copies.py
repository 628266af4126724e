"""Clips of a data set whose files have the same bytes, found before anything is made of them."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from itertools import combinations
from pathlib import Path

from hobble.database.sides import refuse_both_sides
from hobble.workflow.clips import Clips, original
from hobble.workflow.datasets import Datasets


def same_files(clips: Clips, dataset: str) -> list[tuple[str, str, str]]:
    """Pairs of clips with equal files: name, name, "the same file". Only files of one size are read."""
    sizes: dict[int, list[tuple[str, Path]]] = defaultdict(list)
    for clip in clips.listed(dataset):
        path = Path(clips.source(dataset, clip))
        if path.is_file() and (size := path.stat().st_size):
            sizes[size].append((clip, path))
    out = []
    for files in sizes.values():
        if len(files) > 1:
            digests = {clip: _sha256(path) for clip, path in files}
            out += [(a, b, "the same file") for a, b in combinations(digests, 2) if digests[a] == digests[b]]
    return out


def refuse_copies(clips: Clips, datasets: Datasets, dataset: str, channels: tuple[str, ...]) -> None:
    """Raise HobbleError if one file is trained on under one name and held out under another."""
    model = datasets.catalogue.dataset(dataset)
    if model.synthetic is None and model.held_out:
        splits = {original(name): side for name, side in datasets.selected(dataset, channels).items()}
        refuse_both_sides(f"data set {dataset}", same_files(clips, dataset), splits)


def _sha256(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
