"""Tells the rules about a data set: its options, its batches of clips, and which clips are for training.

Each stage of the workflow (motion, labels, ...) has one job for each batch instead of one for each clip,
because a job takes time to start. A data set of up to LEAST_BATCHES clips has a batch for each clip. A larger
data set has LEAST_BATCHES batches, and this number is doubled until a batch holds at most
MOST_CLIPS_OF_A_BATCH clips on average. A hash of a clip's name decides its batch. So a new clip changes only
one batch if the number of batches stays the same. The hurt versions of a batch's clips are a batch, too.

The output of a job is a folder, results/datasets/<dataset>/batches/<stage>/<batch>/. Snakemake plans 500
folders in seconds; listing the 25,000 files in them took five times as long.
"""

import hashlib
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from hobble.core.clip_files import MIRROR_SUFFIX, is_hurt_version, original
from hobble.core.errors import HobbleError
from hobble.core.section import Section
from hobble.hurt.options import HURT_CHANNEL
from hobble.workflow.clips import Clips

LEAST_BATCHES = 12  # a data set with more clips than this has at least this many batches
MOST_CLIPS_OF_A_BATCH = 32  # a batch holds at most this many clips on average


@dataclass(frozen=True)
class ClipBatch:
    """Some clips of a data set, or hurt versions of clips, that one job processes one after another.

    name: the clip's name if each clip has a batch of its own, else a number; with `_hurt` for hurt versions.
    mirrored: whether each clip has a mirror. channels: those whose values the stage `channels` reads.
    """

    name: str
    clips: tuple[str, ...]
    mirrored: bool
    channels: tuple[str, ...]
    hurt: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the clips, then of their mirrors, if there are any."""
        return (*self.clips, *(clip + MIRROR_SUFFIX for clip in self.clips if self.mirrored))

    @property
    def originals(self) -> tuple[str, ...]:
        """The clips from which these hurt versions are made, each once."""
        return tuple(dict.fromkeys(map(original, self.clips)))


class NamedDataset(Clips):
    """What the rules ask about one data set."""

    def options(self, section: str, *keys: str) -> dict[str, Any]:
        """Key -> value of one section as plain data, for `keys` or for all keys."""
        values = getattr(self.settings, section).model_dump(mode="json")
        return {key: values[key] for key in keys} if keys else values

    def options_of(self, section: str, options_class: type[Section]) -> dict[str, Any]:
        """Key -> value of a section as plain data, only for keys that are fields of `options_class`."""
        return self.options(section, *options_class.model_fields)

    def motion_options(self, clip: str) -> dict[str, Any]:
        """The section `motion`, changed by the values in the clip's entry, and with the entry's `ground`."""
        keys = {"source_fps", "loops", "heading", "ground", "frames"}
        return {
            **self.options("motion"),
            **self.entry(clip).model_dump(mode="json", include=keys, exclude_none=True),
        }

    def frames(self, clip: str) -> int:
        """Number of frames, at 60 Hz, of a synthetic clip: its share of the frames of the data set."""
        assert self.settings.synthetic is not None
        all_shares = sum(entry.share for entry in self.listed.values())
        return round(self.settings.synthetic.frames * self.entry(clip).share / all_shares)

    @cached_property
    def batches(self) -> dict[str, ClipBatch]:
        """Name -> batch: first the batches of clips, then those of their hurt versions."""
        count = batch_count(len(self.listed))
        digits = len(str(count - 1))  # all numbers get as many, such as 03 in 00 to 11
        members: dict[str, list[str]] = defaultdict(list)
        for clip in self.listed:
            own = count == len(self.listed)
            members[clip if own else f"{batch_of(clip, count):0{digits}}"].append(clip)
        versions = defaultdict(list)
        for version in self.hurt_versions:
            versions[original(version)].append(version)
        names = list(members) if count == len(self.listed) else sorted(members)
        mirrored, channels = self.settings.mirror, self.channels
        batches = [ClipBatch(name, tuple(members[name]), mirrored, channels) for name in names]
        # The stage `hurt` makes the severities of hurt versions.
        others = tuple(name for name in channels if name != HURT_CHANNEL)
        for batch in list(batches):
            if hurt := tuple(version for clip in batch.clips for version in versions[clip]):
                batches.append(ClipBatch(f"{batch.name}_hurt", hurt, mirrored, others, hurt=True))
        return {batch.name: batch for batch in batches}

    def batch(self, name: str) -> ClipBatch:
        """One batch. Raises HobbleError if the data set has no batch with this name."""
        if name not in self.batches:
            there = ", ".join(self.batches)
            raise HobbleError(f"data set {self.name} has no batch {name:.80}; it has {there}")
        return self.batches[name]

    def folders(self, names: Iterable[str], *stages: str) -> list[str]:
        """The folders with the files that some stages make of some clips.

        names: of clips, mirrors and hurt versions. The stage `hurt` makes the motion, labels and severities
        of hurt versions.
        """
        clips = [clip.removesuffix(MIRROR_SUFFIX) for clip in names]
        if unknown := [clip for clip in clips if clip not in self._batch_of_clip]:
            raise HobbleError(f"data set {self.name} has no clip {unknown[0]!r:.80}")
        found: dict[str, None] = {}
        for batch in dict.fromkeys(self._batch_of_clip[clip] for clip in clips):
            for stage in stages:
                of_hurt = batch.hurt and stage in ("motion", "labels", "channels")
                made_by = ["hurt"] if of_hurt else []
                if stage == "channels":
                    made_by += [stage] if batch.channels else []
                elif not of_hurt:
                    made_by.append(stage)
                found.update(dict.fromkeys(f"{self.root}/batches/{each}/{batch.name}" for each in made_by))
        return list(found)

    @cached_property
    def _batch_of_clip(self) -> dict[str, ClipBatch]:
        """Clip or hurt version -> its batch."""
        return {clip: batch for batch in self.batches.values() for clip in batch.clips}

    def splits(self, channels: Sequence[str]) -> dict[str, str]:
        """Clip -> "train" or "held_out", for the clips that a network can learn from.

        channels: the channels of the network. If the network lacks a channel of the data set, it cannot learn
        from clips in which this channel is not 0, so they are left out. A mirror is in the split of its
        original. Raises HobbleError if the data set lacks one of `channels`, if `held_out` names a clip that
        does not exist, or if no clip is left for training.
        """
        if lacking := [name for name in channels if name not in self.channels]:
            raise HobbleError(
                f"data set {self.name} has no channel {', '.join(lacking)}. Give it a section "
                f"`channels: {{{lacking[0]}: ...}}`, or use another data set"
            )
        held_out = set(self.settings.held_out)
        if missing := held_out - set(self.listed):
            raise HobbleError(
                f"data set {self.name}: held_out names clips that do not exist: "
                f"{', '.join(sorted(missing))}. Correct the names, or take them out of held_out"
            )
        splits, without = {}, set()
        for clip in self.entries:
            unknown = [n for n in self.channels if n not in channels and not self.is_neutral(clip, n)]
            without |= set(unknown)
            for name in () if unknown else (clip, clip + MIRROR_SUFFIX)[: 1 + self.settings.mirror]:
                splits[name] = "held_out" if original(clip) in held_out else "train"
        if "train" not in splits.values():
            suited = f" without {' or '.join(sorted(without))}" if without else ""
            raise HobbleError(
                f"data set {self.name}: no clip{suited} is left to train on. Add clips, or shorten held_out"
            )
        return splits

    def clips_to_compare(self, channels: Sequence[str]) -> list[str]:
        """The clips that a job compares to find copies, so that no motion is both trained on and held out.

        Mirrors and hurt versions are not compared. The list is empty if no clip is held out, or if the clips
        are synthetic.
        """
        splits = self.splits(channels)
        if self.settings.synthetic is not None or len(set(splits.values())) < 2:
            return []
        return [clip for clip in splits if clip == original(clip)]

    @property
    def hurt_row_step(self) -> int:
        """The number n such that training uses every n-th row of the hurt versions."""
        return self.settings.hurt.every if self.settings.hurt else 1


def healthy_originals(clips: Iterable[str]) -> dict[str, str]:
    """Hurt version -> its healthy original, for the hurt versions among some clips.

    The mirror of a hurt version gets the mirror of the original.
    """
    ends = {clip: MIRROR_SUFFIX if clip.endswith(MIRROR_SUFFIX) else "" for clip in clips}
    return {clip: original(clip) + end for clip, end in ends.items() if is_hurt_version(clip)}


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
