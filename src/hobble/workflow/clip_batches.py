"""Divides the clips of a data set into batches.

Each stage of the workflow (motion, labels, ...) has one job for each batch instead of one for each clip,
because a job takes time to start. A data set of up to LEAST_BATCHES clips has a batch for each clip. A larger
data set has LEAST_BATCHES batches, and this number is doubled until a batch holds at most
MOST_CLIPS_OF_A_BATCH clips on average. A hash of a clip's name decides its batch. So a new clip changes only
one batch if the number of batches stays the same.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from hobble.workflow.clips import DATASETS, MIRROR_SUFFIX, Clips, original

LEAST_BATCHES = 12  # a data set with more clips than this has at least this many batches
MOST_CLIPS_OF_A_BATCH = 32  # a batch holds at most this many clips on average
JOB_OPTION = "--target-jobs"  # in the command line of a job that Snakemake starts on another machine
# Separates family, data set and number in the name of a batch's rule: motion_clips__cmu__3.
RULE_NAME_SEPARATOR = "__"


@dataclass(frozen=True)
class ClipBatch:
    """Some clips of a data set, or hurt versions of clips, that one job processes one after another.

    A hurt version is a copy of a healthy clip in which Hobble has made some links of the body injured.

    number: from 0. label: the batch's name in paths of logs: the clip's name if each clip has a batch of its
    own, else the number. mirrored: whether each clip has a mirror. hurt: whether the clips are hurt versions.

    Arguments of the methods: stage: a stage of the workflow, such as motion. family: the name of a rule
    without data set and number, such as motion_clips. file: a path in the data set's folder, with {clip} in
    place of the clip's name, such as motion/{clip}.npz.
    """

    dataset: str
    number: int
    label: str
    clips: tuple[str, ...]
    mirrored: bool
    hurt: bool = False

    def rule(self, family: str) -> str:
        """The name of the batch's rule, such as motion_clips__cmu__3 or hurt_clips__cmu__3_hurt."""
        return RULE_NAME_SEPARATOR.join((family, self.dataset, f"{self.number}{'_hurt' * self.hurt}"))

    def log(self, stage: str, family: str) -> str:
        """Path of the log of the batch's job."""
        return f"{DATASETS}/{self.dataset}/logs/{stage}/{family}/{self.label}.log"

    def benchmark(self, stage: str, family: str) -> str:
        """Path of the benchmark file, in which Snakemake writes time and memory of the batch's job."""
        return f"{DATASETS}/{self.dataset}/benchmarks/{stage}/{family}/{self.label}.tsv"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the clips, then of their mirrors, if there are any."""
        return (*self.clips, *(clip + MIRROR_SUFFIX for clip in self.clips if self.mirrored))

    def of_clips(self, file: str) -> list[str]:
        """Paths of `file` for the clips."""
        return self._paths(file, self.clips)

    def of_mirrors(self, file: str) -> list[str]:
        """Paths of `file` for the mirrors of the clips; [] if there are no mirrors."""
        return self._paths(file, self.names[len(self.clips) :])

    def of_names(self, file: str) -> list[str]:
        """Paths of `file` for the clips, then for their mirrors."""
        return self._paths(file, self.names)

    def of_originals(self, file: str) -> list[str]:
        """In a batch of hurt versions: paths of `file` for the healthy originals of the clips."""
        return self._paths(file, tuple(map(original, self.clips)))

    def _paths(self, file: str, names: Sequence[str]) -> list[str]:
        before, _, after = file.partition("{clip}")
        return [f"{DATASETS}/{self.dataset}/{before}{clip}{after}" for clip in names]


def family_of(rule: str) -> str:
    """The name of a rule without data set and number: motion_clips__cmu__3 -> motion_clips.

    Other names are returned unchanged.
    """
    return rule.partition(RULE_NAME_SEPARATOR)[0]


def dataset_of(rule: str) -> str:
    """The data set of a batch's rule, or "" for other rules."""
    _, mark, rest = rule.partition(RULE_NAME_SEPARATOR)
    return rest.rpartition(RULE_NAME_SEPARATOR)[0] if mark else ""


class Batches:
    """The batches of a project's data sets."""

    def __init__(self, clips: Clips) -> None:
        self.clips = clips

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def of_listed_clips(self, dataset: str) -> tuple[ClipBatch, ...]:
        """The batches of a data set's clips, without hurt versions."""
        listed = list(self.clips.listed_entries(dataset))  # names of the clips
        mirrored = self.clips.catalogue.dataset(dataset).mirror
        count = batch_count(len(listed))
        if count == len(listed):
            return tuple(ClipBatch(dataset, n, clip, (clip,), mirrored) for n, clip in enumerate(listed))
        members = defaultdict(list)
        for clip in listed:
            members[batch_of(clip, count)].append(clip)
        digits = len(str(count - 1))  # all numbers get as many, such as 03 in 00 to 11
        return tuple(
            ClipBatch(dataset, n, f"{n:0{digits}}", tuple(clips), mirrored)
            for n, clips in sorted(members.items())
        )

    @functools.cache  # noqa: B019
    def of_hurt_versions(self, dataset: str) -> tuple[ClipBatch, ...]:
        """The batches of hurt versions: one for each batch whose clips have hurt versions."""
        versions = defaultdict(list)
        for version in self.clips.hurt_versions(dataset):
            versions[original(version)].append(version)
        batches = []
        for batch in self.of_listed_clips(dataset):
            members = tuple(version for clip in batch.clips for version in versions[clip])
            if members:
                label = f"{batch.label}_hurt"
                batches.append(ClipBatch(dataset, batch.number, label, members, batch.mirrored, hurt=True))
        return tuple(batches)

    def of_clips_and_hurt_versions(self, dataset: str) -> tuple[ClipBatch, ...]:
        """The batches of clips, then the batches of hurt versions."""
        return (*self.of_listed_clips(dataset), *self.of_hurt_versions(dataset))

    def needed(
        self,
        batches_of: Callable[[str], Iterable[ClipBatch]],
        datasets: Iterable[str],
        arguments: Sequence[str],
    ) -> list[ClipBatch]:
        """The batches of these data sets that a run of Snakemake needs.

        batches_of: returns the batches of a data set, such as `self.of_listed_clips`. arguments: the command
        line of the run. A job on another machine is a run whose command line names the rule. It needs only
        the batch of this rule.
        """
        rules = rules_of_job(arguments)
        batches = [batch for dataset in datasets for batch in batches_of(dataset)]
        return [
            batch
            for batch in batches
            if not rules or any(batch.rule(family_of(rule)) == rule for rule in rules)
        ]


def rules_of_job(arguments: Sequence[str]) -> list[str]:
    """The rules that a command line names if it is that of a job on another machine; else [].

    In such a command line, JOB_OPTION is followed by <rule>:<wildcards>, once or several times.
    """
    if JOB_OPTION not in arguments:
        return []
    after = arguments[arguments.index(JOB_OPTION) + 1 :]
    jobs = itertools.takewhile(lambda argument: not argument.startswith("--"), after)
    return [job.rpartition(":")[0] for job in jobs]


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
