"""Batches of a data set's clips: each stage has one job for each batch, because a job takes time to start.

Up to LEAST_BATCHES clips have a batch each. More are put into LEAST_BATCHES batches by a hash of their names,
and the number of batches doubles until they hold at most MOST_CLIPS_OF_A_BATCH clips on average. So a new
clip changes one batch.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from hobble.workflow.clips import DATASETS, MIRROR_SUFFIX, Clips, original

LEAST_BATCHES = 12  # least number of batches of a data set that has more clips than this
MOST_CLIPS_OF_A_BATCH = 32  # most clips in a batch, on average
JOB_OPTION = "--target-jobs"  # in the command of a job that Snakemake starts; <rule>:<wildcards> follow
MARK = "__"  # separates the parts of the name of a batch's rule


@dataclass(frozen=True)
class ClipBatch:
    """Some clips of a data set that one job makes after another, or the hurt versions of these clips.

    number: from 0. label: the batch's name in logs, which is the clip's name if every clip has a batch of its
    own. mirrored: whether each clip has a mirror. hurt: whether the clips are hurt versions.
    """

    dataset: str
    number: int
    label: str
    clips: tuple[str, ...]
    mirrored: bool
    hurt: bool = False

    def rule(self, family: str) -> str:
        """The name of the batch's rule, such as motion_clips__cmu__3."""
        return MARK.join((family, self.dataset, f"{self.number}{'_hurt' * self.hurt}"))

    def log(self, stage: str, family: str) -> str:
        """The log of the batch's job."""
        return f"{DATASETS}/{self.dataset}/logs/{stage}/{family}/{self.label}.log"

    def benchmark(self, stage: str, family: str) -> str:
        """The benchmark file of the batch's job."""
        return f"{DATASETS}/{self.dataset}/benchmarks/{stage}/{family}/{self.label}.tsv"

    @property
    def names(self) -> tuple[str, ...]:
        """The clips, then their mirrors."""
        return (*self.clips, *(clip + MIRROR_SUFFIX for clip in self.clips if self.mirrored))

    def of_clips(self, file: str) -> list[str]:
        """Path of a file, such as motion/{clip}.npz, for each clip."""
        return self._paths(file, self.clips)

    def of_mirrors(self, file: str) -> list[str]:
        """Path of a file for the mirror of each clip; none if there are no mirrors."""
        return self._paths(file, self.names[len(self.clips) :])

    def of_names(self, file: str) -> list[str]:
        """Path of a file for each clip, then for each mirror."""
        return self._paths(file, self.names)

    def of_originals(self, file: str) -> list[str]:
        """Path of a file, for the clip from which each hurt version is made."""
        return self._paths(file, tuple(map(original, self.clips)))

    def _paths(self, file: str, names: Sequence[str]) -> list[str]:
        folder, _, name = file.partition("{clip}")
        return [f"{DATASETS}/{self.dataset}/{folder}{clip}{name}" for clip in names]


def family_of(rule: str) -> str:
    """The name of a rule without data set and number: motion_clips__cmu__3 -> motion_clips.

    Other names are returned unchanged.
    """
    return rule.partition(MARK)[0]


def dataset_of(rule: str) -> str:
    """The data set of a batch's rule, or "" for other rules."""
    _, mark, rest = rule.partition(MARK)
    return rest.rpartition(MARK)[0] if mark else ""


class Batches:
    """The batches of a project's data sets."""

    def __init__(self, clips: Clips) -> None:
        self.clips = clips

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def of(self, dataset: str) -> tuple[ClipBatch, ...]:
        """The batches of the clips that a data set lists or that are in its folder."""
        listed = list(self.clips.listed(dataset))
        mirrored = self.clips.catalogue.dataset(dataset).mirror
        count = batch_count(len(listed))
        if count == len(listed):
            return tuple(ClipBatch(dataset, n, clip, (clip,), mirrored) for n, clip in enumerate(listed))
        chosen = defaultdict(list)
        for clip in listed:
            chosen[batch_of(clip, count)].append(clip)
        width = len(str(count - 1))
        return tuple(
            ClipBatch(dataset, n, f"{n:0{width}}", tuple(clips), mirrored)
            for n, clips in sorted(chosen.items())
        )

    @functools.cache  # noqa: B019
    def hurt_of(self, dataset: str) -> tuple[ClipBatch, ...]:
        """The batches of hurt versions: one for each batch with clips that have hurt versions."""
        versions = defaultdict(list)
        for version in self.clips.hurt_versions(dataset):
            versions[original(version)].append(version)
        found = []
        for batch in self.of(dataset):
            hurt = tuple(version for clip in batch.clips for version in versions[clip])
            if hurt:
                label = f"{batch.label}_hurt"
                found.append(ClipBatch(dataset, batch.number, label, hurt, batch.mirrored, hurt=True))
        return tuple(found)

    def all_of(self, dataset: str) -> tuple[ClipBatch, ...]:
        """The batches of clips and those of hurt versions."""
        return (*self.of(dataset), *self.hurt_of(dataset))

    def needed(
        self,
        of: Callable[[str], Iterable[ClipBatch]],
        datasets: Iterable[str],
        arguments: Sequence[str],
    ) -> list[ClipBatch]:
        """The batches of these data sets that a run needs.

        of: function data set -> its batches. arguments: of the command line. A job on another machine is a
        run of one rule, which needs only the batch of this rule.
        """
        rules = rules_of_job(arguments)
        found = [batch for dataset in datasets for batch in of(dataset)]
        return [batch for batch in found if not rules or any(batch.rule(family_of(r)) == r for r in rules)]


def rules_of_job(arguments: Sequence[str]) -> list[str]:
    """The rules of a job that Snakemake starts on another machine, from its command line; else []."""
    if JOB_OPTION not in arguments:
        return []
    after = arguments[arguments.index(JOB_OPTION) + 1 :]
    jobs = itertools.takewhile(lambda argument: not argument.startswith("--"), after)
    return [job.rpartition(":")[0] for job in jobs]


def batch_count(clips: int) -> int:
    """The number of batches of a data set with so many clips. Up to LEAST_BATCHES clips have a batch each."""
    count = min(clips, LEAST_BATCHES)
    while clips > count * MOST_CLIPS_OF_A_BATCH:
        count *= 2
    return count


def batch_of(clip: str, count: int) -> int:
    """The number of the clip's batch among `count`. It depends on no other clip."""
    digest = hashlib.sha256(clip.encode(errors="surrogateescape")).digest()
    return int.from_bytes(digest[:8], "big") % count
