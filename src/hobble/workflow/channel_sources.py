"""What the clips of a data set are told: its channels, and where each one's values come from."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from hobble.channels import NAMES, Source, channel
from hobble.config.load import Catalogue
from hobble.core.errors import HobbleError, InputError

if TYPE_CHECKING:
    from hobble.workflow.clips import Clips

NO_CHANNEL = "plain"  # the folder of the database whose network is told nothing


class ChannelSources:
    """The channels of the data sets of a project."""

    def __init__(self, catalogue: Catalogue, clips: Clips) -> None:
        self.catalogue, self.clips = catalogue, clips

    def channels(self, dataset: str) -> tuple[str, ...]:
        """The channels that clips are told: those that the data set has a section for, and those without."""
        given = self.catalogue.dataset(dataset).channels
        return tuple(name for name in NAMES if name in given or channel(name).Options is None)

    def files(self, dataset: str, clip: str, name: str) -> list[str]:
        """What channel `name` reads of a clip: the file beside it, if its entry says nothing, and tables."""
        one, made = channel(name), self.catalogue.dataset(dataset).synthetic is not None
        said = self._value(dataset, clip, name) is not None and not made
        beside = self.clips.side_files(dataset, clip, (one.suffix,)) if one.suffix and not said else []
        return [*beside, *self._tables(dataset, name)]

    def source(self, dataset: str, clip: str, name: str) -> dict[str, Any]:
        """What the data set says of a clip to channel `name`: plain data, all of a `Source` but files."""
        return {
            "clip": self.clips.original(clip),
            "entry": self.clips.entry(dataset, clip).model_dump(mode="json", exclude={"channels"}),
            "value": self._value(dataset, clip, name),
            "options": self.catalogue.dataset(dataset).channels.get(name, {}),
        }

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def neutral(self, dataset: str, clip: str, name: str) -> bool:
        """Whether a clip is told nothing by channel `name`."""
        if self.clips.is_hurt_version(clip) and name == self.clips.hurt_channel:
            return False
        made = self.catalogue.dataset(dataset).synthetic is not None
        files = self._tables(dataset, name) if made else self.files(dataset, clip, name)
        return channel(name).is_neutral(Source(**self.source(dataset, clip, name), files=files))

    def check(self, dataset: str) -> None:
        """Raise HobbleError for what the entries or options say that a channel cannot understand."""
        model = self.catalogue.dataset(dataset)
        rig = self.catalogue.skeleton(model.skeleton)
        for clip, entry in self.clips.listed(dataset).items():
            if extra := set(entry.channels) - set(self.channels(dataset)):
                raise HobbleError(
                    f"data set {dataset}: clips.{clip}.channels: the data set has no "
                    f"{', '.join(sorted(extra))}; it has {', '.join(self.channels(dataset)) or 'none'}"
                )
            for name in self.channels(dataset):
                said = self.source(dataset, clip, name) | {"clip": f"data set {dataset}: clips.{clip}"}
                channel(name).check(Source(**said, files=self._tables(dataset, name)), rig)

    def _value(self, dataset: str, clip: str, name: str) -> Any:
        return self.clips.entry(dataset, clip).channels.get(name)

    def _tables(self, dataset: str, name: str) -> list[str]:
        given: Sequence[str] = channel(name).tables(self.catalogue.dataset(dataset).channels.get(name, {}))
        files = [self.clips.mocap / file for file in given]
        for file in files:
            if not file.is_file():
                fix = "Put it there, or name the folder that holds it with --config mocap=FOLDER."
                raise InputError(file, f"no such file, but data set {dataset} reads it", fix=fix)
        return [str(file) for file in files]


def database_folder(told: Sequence[str]) -> str:
    """The name of the database whose network is told these channels."""
    return "+".join(told) or NO_CHANNEL


def channels_of_folder(folder_name: str) -> tuple[str, ...]:
    """The inverse of `folder`. Raises HobbleError for no such name."""
    names = () if folder_name == NO_CHANNEL else tuple(folder_name.split("+"))
    if any(name not in NAMES for name in names) or list(names) != sorted(set(names), key=NAMES.index):
        raise HobbleError(
            f"no database is called {folder_name}. It is `{NO_CHANNEL}` or names of channels with + between "
            f"them, in the order {', '.join(NAMES)}"
        )
    return names
