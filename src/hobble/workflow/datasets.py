"""Tells Snakemake's rules about data sets: their options, their clips, and which clips are for training."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from hobble.config.load_configuration import Catalogue
from hobble.core.errors import HobbleError
from hobble.core.section import Section
from hobble.workflow.clips import MIRROR_SUFFIX, Clips, original


class Datasets:
    """The data sets of a project. Most methods have the name of a data set as first argument."""

    def __init__(self, catalogue: Catalogue, clips: Clips) -> None:
        self.catalogue, self.clips, self.channel_sources = catalogue, clips, clips.channel_sources

    def options(self, dataset: str, section: str, *keys: str) -> dict[str, Any]:
        """Key -> value of one section of a data set as plain data, for `keys` or for all keys."""
        values = getattr(self.catalogue.dataset(dataset), section).model_dump(mode="json")
        return {key: values[key] for key in keys} if keys else values

    def options_of_class(self, dataset: str, section: str, options_class: type[Section]) -> dict[str, Any]:
        """Key -> value of a section as plain data, only for keys that are fields of `options_class`."""
        return self.options(dataset, section, *options_class.model_fields)

    def motion_options(self, dataset: str, clip: str) -> dict[str, Any]:
        """The section `motion`, changed by the values in the clip's entry, and with the entry's `ground`."""
        keys = {"source_fps", "loops", "heading", "ground", "frames"}
        entry = self.clips.entry(dataset, clip).model_dump(mode="json", include=keys, exclude_none=True)
        return {**self.options(dataset, "motion"), **entry}

    def frames(self, dataset: str, clip: str) -> int:
        """Number of frames, at 60 Hz, of a synthetic clip: its share of the frames of the data set."""
        synthetic = self.catalogue.dataset(dataset).synthetic
        assert synthetic is not None
        all_shares = sum(entry.share for entry in self.clips.listed_entries(dataset).values())
        return round(synthetic.frames * self.clips.entry(dataset, clip).share / all_shares)

    def walkers(self, names: Iterable[str]) -> list[str]:
        """The data sets whose walkers make the synthetic clips of the data sets `names`.

        A walker computes the motion of synthetic clips. A data set uses the walker of its `source`, or its
        own if it has no `source`.
        """
        settings = {name: self.catalogue.dataset(name) for name in names}
        walkers = [each.source or name for name, each in settings.items() if each.synthetic is not None]
        return list(dict.fromkeys(walkers))

    def splits(self, dataset: str, channels: Sequence[str]) -> dict[str, str]:
        """Clip -> "train" or "held_out", for the clips that a network can learn from.

        channels: the channels of the network. If the network lacks a channel of the data set, it cannot learn
        from clips in which this channel is not 0, so they are left out. A mirror is in the split of its
        original. Raises HobbleError if the data set lacks one of `channels`, if `held_out` names a clip that
        does not exist, or if no clip is left for training.
        """
        available = self.channel_sources.channels(dataset)
        if lacking := [name for name in channels if name not in available]:
            raise HobbleError(
                f"data set {dataset} has no channel {', '.join(lacking)}. Give it a section "
                f"`channels: {{{lacking[0]}: ...}}`, or use another data set"
            )
        unused = [name for name in available if name not in channels]
        settings, clips = self.catalogue.dataset(dataset), self.clips.entries(dataset)
        held_out = set(settings.held_out)
        if missing := held_out - set(self.clips.listed_entries(dataset)):
            missing_names = ", ".join(sorted(missing))
            raise HobbleError(
                f"data set {dataset}: held_out names clips that do not exist: {missing_names}. Correct the "
                "names, or take them out of held_out"
            )
        splits = {}
        for clip in clips:
            if not all(self.channel_sources.is_neutral(dataset, clip, name) for name in unused):
                continue
            for name in (clip, clip + MIRROR_SUFFIX) if settings.mirror else (clip,):
                splits[name] = "held_out" if original(clip) in held_out else "train"
        if "train" not in splits.values():
            leave_out = [
                name
                for name in unused
                if not all(self.channel_sources.is_neutral(dataset, clip, name) for clip in clips)
            ]
            without = f" without {' or '.join(leave_out)}" if leave_out else ""
            raise HobbleError(
                f"data set {dataset}: no clip{without} is left to train on. Add clips, or shorten held_out"
            )
        return splits

    def clips_to_compare(self, dataset: str, channels: Sequence[str]) -> list[str]:
        """The clips that a job compares to find copies, so that no motion is both trained on and held out.

        Mirrors and hurt versions are not compared. The list is empty if no clip is held out, or if the clips
        are synthetic.
        """
        if self.catalogue.dataset(dataset).synthetic is not None:
            return []
        splits = self.splits(dataset, channels)
        if len(set(splits.values())) < 2:
            return []
        return [clip for clip in splits if clip == original(clip)]

    def hurt_row_step(self, dataset: str) -> int:
        """The number n such that training uses every n-th row of the hurt versions."""
        hurt = self.catalogue.dataset(dataset).hurt
        return hurt.every if hurt else 1

    def sources(self, chosen: Iterable[str]) -> dict[str, str]:
        """Hurt version -> its healthy original, for the hurt versions among the chosen clips.

        The mirror of a hurt version gets the mirror of the original.
        """
        chosen = list(chosen)
        suffixes = {clip: MIRROR_SUFFIX if clip.endswith(MIRROR_SUFFIX) else "" for clip in chosen}
        return {clip: original(clip) + suffixes[clip] for clip in chosen if self.clips.is_hurt_version(clip)}
