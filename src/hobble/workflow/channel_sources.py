"""Finds the channels of a data set, and the files or options that give their values for each clip.

A channel is an input of the network besides motion and ground. Its values are 0 or more.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from hobble.channels import CHANNEL_NAMES, channel
from hobble.config.load_configuration import Catalogue
from hobble.core.errors import HobbleError, InputError

if TYPE_CHECKING:
    from hobble.workflow.clips import Clips

NO_CHANNEL = "plain"  # name of the folder of a database without channels


class ChannelSources:
    """The channels of a project's data sets, and the sources of their values."""

    def __init__(self, catalogue: Catalogue, clips: Clips) -> None:
        self.catalogue, self.clips = catalogue, clips

    def channels(self, dataset: str) -> tuple[str, ...]:
        """The channels of a data set: those with a section in its file, and those that need no section."""
        sections = self.catalogue.dataset(dataset).channels
        return tuple(name for name in CHANNEL_NAMES if name in sections or channel(name).Options is None)

    def files(self, dataset: str, clip: str, name: str) -> list[str]:
        """The files that channel `name` reads for a clip.

        They are the file beside the clip, and the tables of all clips that the channel's options name. The
        file beside the clip is left out if the clip's entry in the data set has a value for the channel.
        """
        suffix, has_value = channel(name).suffix, self._value(dataset, clip, name) is not None
        files = self.clips.side_files(dataset, clip, (suffix,)) if suffix and not has_value else []
        return [*files, *self._tables(dataset, name)]

    def source(self, dataset: str, clip: str, name: str) -> dict[str, Any]:
        """What the data set says about the values of channel `name` in a clip, as plain data.

        The keys are the fields of `hobble.channels.channel.ClipSource`, without `files`.
        """
        return {
            "clip": self.clips.original(clip),
            "entry": self.clips.entry(dataset, clip).model_dump(
                mode="json", exclude={"channels", "hurt", "person"}
            ),
            "value": self._value(dataset, clip, name),
            "options": self.catalogue.dataset(dataset).channels.get(name, {}),
        }

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def is_neutral(self, dataset: str, clip: str, name: str) -> bool:
        """Whether all values of channel `name` are 0 in a clip."""
        if self.clips.is_hurt_version(clip) and name == self.clips.hurt_channel:
            return False
        # The file beside a synthetic clip is not read, because it need not exist yet.
        synthetic = self.catalogue.dataset(dataset).synthetic is not None
        files = self._tables(dataset, name) if synthetic else self.files(dataset, clip, name)
        definition = channel(name)
        return definition.is_neutral(definition.make_source(self.source(dataset, clip, name), files))

    def check(self, dataset: str) -> None:
        """Raise HobbleError if the data set's clip entries or options are wrong about channels."""
        settings = self.catalogue.dataset(dataset)
        rig = self.catalogue.skeleton(settings.skeleton)
        for clip, entry in self.clips.listed_entries(dataset).items():
            if unknown := set(entry.channels) - set(self.channels(dataset)):
                raise HobbleError(
                    f"data set {dataset}: clips.{clip}.channels: the data set has no channel "
                    f"{', '.join(sorted(unknown))}; it has {', '.join(self.channels(dataset)) or 'none'}"
                )
            for name in self.channels(dataset):
                # Error messages show "clip", so it names the place in the data set's file.
                fields = self.source(dataset, clip, name) | {"clip": f"data set {dataset}: clips.{clip}"}
                definition = channel(name)
                definition.check(definition.make_source(fields, self._tables(dataset, name)), rig)

    def _value(self, dataset: str, clip: str, name: str) -> Any:
        """The value of channel `name` in the clip's entry, or None."""
        return self.clips.entry(dataset, clip).channels.get(name)

    def _tables(self, dataset: str, name: str) -> list[str]:
        """Paths of the tables in the options of channel `name`. Raises InputError if a table is missing."""
        definition, section = channel(name), self.catalogue.dataset(dataset).channels.get(name, {})
        tables = definition.table_files(definition.options_of(section))
        files = [self.clips.mocap / file for file in tables]
        for file in files:
            if not file.is_file():
                fix = "Put it there, or name the folder that holds it with --config mocap=FOLDER."
                raise InputError(file, f"no such file, but data set {dataset} reads it", fix=fix)
        return [str(file) for file in files]


def database_folder(channels: Sequence[str]) -> str:
    """The name of the folder that holds the database with these channels."""
    return "+".join(channels) or NO_CHANNEL


def channels_of_folder(folder_name: str) -> tuple[str, ...]:
    """The channels of the database in a folder, from the folder's name: the inverse of `database_folder`.

    Raises HobbleError for a name that no database can have.
    """
    names = () if folder_name == NO_CHANNEL else tuple(folder_name.split("+"))
    if any(name not in CHANNEL_NAMES for name in names) or list(names) != sorted(
        set(names), key=CHANNEL_NAMES.index
    ):
        raise HobbleError(
            f"no database can be called {folder_name}. A database without channels is called `{NO_CHANNEL}`. "
            f"Any other is called by its channels with + between them, in the order "
            f"{', '.join(CHANNEL_NAMES)}"
        )
    return names
