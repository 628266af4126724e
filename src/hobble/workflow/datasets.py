"""What rules have to know about a data set: its options, its clip entries, the clips for training."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from typing import Any

from hobble.config.load_configuration import Catalogue
from hobble.core.errors import HobbleError
from hobble.core.section import Section
from hobble.workflow.clip_batches import batch_of
from hobble.workflow.clips import MIRROR_SUFFIX, Clips, original


def shard_of(clip: str, shards: int) -> int:
    """The number, from 0, of the database shard with a clip's rows. shards: number of shards.

    Mirrors and hurt versions are in the shard of their original. Other clips do not change the shard. If the
    number of batches is a multiple of `shards`, all clips of a batch are in the same shard.
    """
    return batch_of(original(clip), shards)


class Datasets:
    """The data sets of a project."""

    def __init__(self, catalogue: Catalogue, clips: Clips) -> None:
        self.catalogue, self.clips, self.channel_sources = catalogue, clips, clips.channel_sources

    def options(self, dataset: str, section: str, *keys: str) -> dict[str, Any]:
        """Key -> value of one section of a data set as plain data, for `keys` or for all keys."""
        values = getattr(self.catalogue.dataset(dataset), section).model_dump(mode="json")
        return {key: values[key] for key in keys} if keys else values

    def part(self, dataset: str, section: str, model: type[Section]) -> dict[str, Any]:
        """Key -> value of a section as plain data, only for keys that are fields of `model`."""
        return self.options(dataset, section, *model.model_fields)

    def motion_options(self, dataset: str, clip: str) -> dict[str, Any]:
        """The section `motion`, but with the values that the clip's entry has, and the entry's `ground`."""
        keys = {"source_fps", "loops", "heading", "ground"}
        entry = self.clips.entry(dataset, clip).model_dump(include=keys, exclude_none=True)
        return {**self.options(dataset, "motion"), **entry}

    def frames(self, dataset: str, clip: str) -> int:
        """Number of frames at 60 Hz of a synthetic clip."""
        synthetic = self.catalogue.dataset(dataset).synthetic
        assert synthetic is not None
        total = sum(entry.share for entry in self.clips.listed(dataset).values())
        return round(synthetic.frames * self.clips.entry(dataset, clip).share / total)

    def walkers(self, names: Iterable[str]) -> list[str]:
        """The data sets whose walkers make the synthetic clips of the data sets `names`."""
        models = {name: self.catalogue.dataset(name) for name in names}
        walkers = [model.source or name for name, model in models.items() if model.synthetic is not None]
        return list(dict.fromkeys(walkers))

    def selected(self, dataset: str, channels: Sequence[str]) -> dict[str, str]:
        """Clip -> "train" or "held_out", for the clips that a network can learn from.

        channels: the channels of the network. A clip is left out if a channel that the network lacks is not 0
        in it. A mirror is trained on or held out like its original. Raises HobbleError if the data set lacks
        one of `channels`, if `held_out` names a clip that does not exist, or if no clip is left for training.
        """
        available = self.channel_sources.channels(dataset)
        if lacking := [name for name in channels if name not in available]:
            raise HobbleError(
                f"data set {dataset} has no channel {', '.join(lacking)}. Give it a section "
                f"`channels: {{{lacking[0]}: ...}}`, or use another data set"
            )
        others = [name for name in available if name not in channels]
        model, clips = self.catalogue.dataset(dataset), self.clips.of(dataset)
        held_out = set(model.held_out)
        if missing := held_out - set(self.clips.listed(dataset)):
            missing_names = ", ".join(sorted(missing))
            raise HobbleError(f"data set {dataset}: held_out names clips that do not exist: {missing_names}")
        splits = {}
        for clip in clips:
            if not all(self.channel_sources.neutral(dataset, clip, name) for name in others):
                continue
            for name in (clip, clip + MIRROR_SUFFIX) if model.mirror else (clip,):
                splits[name] = "held_out" if original(clip) in held_out else "train"
        if "train" not in splits.values():
            only = f" without {' or '.join(others)}" if others else ""
            raise HobbleError(f"data set {dataset}: no clip{only} is left to train on")
        return splits

    def compared(self, dataset: str, channels: Sequence[str]) -> list[str]:
        """The clips among which jobs look for copies, so that no motion is both trained on and held out.

        Mirrors and hurt versions are not among them. [] if nothing is held out or the clips are synthetic.
        """
        if self.catalogue.dataset(dataset).synthetic is not None:
            return []
        splits = self.selected(dataset, channels)
        both = len(set(splits.values())) > 1
        return [clip for clip in splits if both and clip == original(clip)]

    def shards(self, dataset: str) -> int:
        """The number of shards of each of the data set's databases."""
        return int(self.options(dataset, "database", "shards")["shards"])

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def _splits_by_shard(self, dataset: str, channels: tuple[str, ...]) -> list[dict[str, str]]:
        count = self.shards(dataset)
        splits: list[dict[str, str]] = [{} for _ in range(count)]
        for clip, split in self.selected(dataset, channels).items():
            splits[shard_of(clip, count)][clip] = split
        return splits

    def in_shard(self, dataset: str, channels: Sequence[str], shard: int) -> dict[str, str]:
        """What `selected` returns, for the clips of one shard only. shard: its number, from 0."""
        return self._splits_by_shard(dataset, tuple(channels))[shard]

    def every_row(self, dataset: str) -> int:
        """The n for which training uses every n-th row of hurt versions."""
        hurt = self.catalogue.dataset(dataset).hurt
        return hurt.every if hurt else 1

    def sources(self, chosen: Iterable[str]) -> dict[str, str]:
        """Hurt version -> its healthy original, for the hurt versions among the chosen clips.

        For the mirror of a hurt version: the mirror of the original.
        """
        chosen = list(chosen)
        mirrors = {clip: MIRROR_SUFFIX if clip.endswith(MIRROR_SUFFIX) else "" for clip in chosen}
        return {clip: original(clip) + mirrors[clip] for clip in chosen if self.clips.is_hurt_version(clip)}
