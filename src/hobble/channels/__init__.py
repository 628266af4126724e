"""Channels: inputs of the network besides motion and ground, such as an injury. NAMES lists them."""

from __future__ import annotations

import functools
import importlib
import importlib.util
from collections.abc import Iterable

from hobble.channels.channel import Channel, ClipSource

__all__ = [
    "NAMES",
    "Channel",
    "ClipSource",
    "all_channels",
    "channel",
    "channel_of_old_key",
    "modules_of",
    "shown_modules",
]

# All channels. Each name is a package in this folder. The package's CHANNEL is an instance of `Channel`.
NAMES = ("injury", "mood", "diagnosis")


@functools.cache
def channel(name: str) -> Channel:
    """The channel `name`. Raises KeyError with all names if there is no such channel.

    The module is imported here and not at the top, so that a job depends only on the code of the channels
    that it uses.
    """
    if name not in NAMES:
        raise KeyError(f"no channel {name!r}: there are {', '.join(NAMES)}")
    found = importlib.import_module(f"{__name__}.{name}").CHANNEL
    assert isinstance(found, Channel)
    assert found.name == name
    return found


def all_channels() -> tuple[Channel, ...]:
    """All channels, in the order of NAMES."""
    return tuple(channel(name) for name in NAMES)


def modules_of(names: Iterable[str]) -> list[str]:
    """Full names of the packages of these channels. A job that uses the channels depends on their code."""
    return [f"{__name__}.{name}" for name in names]


def shown_modules() -> list[str]:
    """Full names of the existing modules channels.<name>.shown, which say how a page shows a channel."""
    found = (f"{__name__}.{name}.shown" for name in NAMES)
    return [module for module in found if importlib.util.find_spec(module) is not None]


def channel_of_old_key(key: str) -> str:
    """The channel that `key` stands for in old files, which do not name channels.

    Raises ValueError for an unknown key.
    """
    for one in all_channels():
        if key in one.old_keys:
            return one.name
    raise ValueError(f"there is no such key: {key}")
