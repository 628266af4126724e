"""Divides the clips of a data set into batches, and knows the folders of their files.

Each stage of the workflow (motion, labels, ...) has one job for each batch instead of one for each clip,
because a job takes time to start. A data set of up to LEAST_BATCHES clips has a batch for each clip. A larger
data set has LEAST_BATCHES batches, and this number is doubled until a batch holds at most
MOST_CLIPS_OF_A_BATCH clips on average. A hash of a clip's name decides its batch. So a new clip changes only
one batch if the number of batches stays the same. The hurt versions of a batch's clips are a batch, too.

The output of a job is a folder, results/datasets/<dataset>/batches/<stage>/<batch>/. Snakemake plans 500
folders in seconds; listing the 25,000 files in them took five times as long.
"""

from __future__ import annotations

import functools
import hashlib
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

from hobble.core.errors import HobbleError
from hobble.workflow.clips import DATASETS, HURT_CHANNEL, MIRROR_SUFFIX, Clips, original

LEAST_BATCHES = 12  # a data set with more clips than this has at least this many batches
MOST_CLIPS_OF_A_BATCH = 32  # a batch holds at most this many clips on average


@dataclass(frozen=True)
class ClipBatch:
    """Some clips of a data set, or hurt versions of clips, that one job processes one after another.

    name: the clip's name if each clip has a batch of its own, else a number; with `_hurt` for hurt versions.
    mirrored: whether each clip has a mirror.
    """

    dataset: str
    name: str
    clips: tuple[str, ...]
    mirrored: bool
    hurt: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the clips, then of their mirrors, if there are any."""
        return (*self.clips, *(clip + MIRROR_SUFFIX for clip in self.clips if self.mirrored))

    @property
    def originals(self) -> tuple[str, ...]:
        """The clips from which these hurt versions are made, each once."""
        return tuple(dict.fromkeys(map(original, self.clips)))


class Batches:
    """The batches of a project's data sets."""

    def __init__(self, clips: Clips) -> None:
        self.clips = clips

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def of_dataset(self, dataset: str) -> dict[str, ClipBatch]:
        """Name -> batch: first the batches of clips, then those of their hurt versions."""
        listed = list(self.clips.listed_entries(dataset))
        mirrored = self.clips.catalogue.dataset(dataset).mirror
        count = batch_count(len(listed))
        digits = len(str(count - 1))  # all numbers get as many, such as 03 in 00 to 11
        members: dict[str, list[str]] = defaultdict(list)
        for clip in listed:
            members[clip if count == len(listed) else f"{batch_of(clip, count):0{digits}}"].append(clip)
        versions = defaultdict(list)
        for version in self.clips.hurt_versions(dataset):
            versions[original(version)].append(version)
        names = list(members) if count == len(listed) else sorted(members)
        batches = [ClipBatch(dataset, name, tuple(members[name]), mirrored) for name in names]
        for batch in list(batches):
            if hurt := tuple(version for clip in batch.clips for version in versions[clip]):
                batches.append(ClipBatch(dataset, f"{batch.name}_hurt", hurt, mirrored, hurt=True))
        return {batch.name: batch for batch in batches}

    def named(self, dataset: str, name: str) -> ClipBatch:
        """One batch. Raises HobbleError if the data set has no batch with this name."""
        batches = self.of_dataset(dataset)
        if name not in batches:
            raise HobbleError(f"data set {dataset} has no batch {name:.80}; it has {', '.join(batches)}")
        return batches[name]

    def channels(self, batch: ClipBatch) -> list[str]:
        """The channels whose values the stage `channels` reads for a batch.

        The stage `hurt` makes the severities of hurt versions.
        """
        names = self.clips.channel_sources.channels(batch.dataset)
        return [name for name in names if not (batch.hurt and name == HURT_CHANNEL)]

    def folders(self, dataset: str, names: Iterable[str], *stages: str) -> list[str]:
        """The folders with the files that some stages make of some clips.

        names: of clips, mirrors and hurt versions. The stage `hurt` makes the motion, labels and severities
        of hurt versions.
        """
        batch_names = self._batch_names(dataset)
        found: dict[str, None] = {}
        clips = [clip.removesuffix(MIRROR_SUFFIX) for clip in names]
        if unknown := [clip for clip in clips if clip not in batch_names]:
            raise HobbleError(f"data set {dataset} has no clip {unknown[0]!r:.80}")
        for name in dict.fromkeys(batch_names[clip] for clip in clips):
            batch = self.named(dataset, name)
            for stage in stages:
                if batch.hurt and stage in ("motion", "labels", "channels"):
                    found[f"{DATASETS}/{dataset}/batches/hurt/{name}"] = None
                if stage == "channels" and not self.channels(batch):
                    continue
                if not (batch.hurt and stage in ("motion", "labels")):
                    found[f"{DATASETS}/{dataset}/batches/{stage}/{name}"] = None
        return list(found)

    @functools.cache  # noqa: B019
    def _batch_names(self, dataset: str) -> dict[str, str]:
        """Clip or hurt version -> the name of its batch."""
        return {clip: batch.name for batch in self.of_dataset(dataset).values() for clip in batch.clips}


def batch_count(clips: int) -> int:
    """The number of batches of a data set with this number of clips; see the module's docstring."""
    count = min(clips, LEAST_BATCHES)
    while clips > count * MOST_CLIPS_OF_A_BATCH:
        count *= 2
    return count


def batch_of(clip: str, count: int) -> int:
    """The number of the clip's batch, from 0 to `count` - 1. It does not depend on other clips."""
    digest = hashlib.sha256(clip.encode(errors="surrogateescape")).digest()
    return int.from_bytes(digest[:8], "big") % count
