"""What the body is told beside where to go: each channel in a folder of its own, named in the list below."""

from __future__ import annotations

import functools
import importlib
import importlib.util
from collections.abc import Iterable

from hobble.channels.channel import Channel, Source

__all__ = ["NAMES", "Channel", "Source", "channel", "every", "formerly", "modules_of", "shown_modules"]

# Every channel that there is: the folder NAME beside this file, whose package has the channel as CHANNEL.
NAMES = ("injury", "mood", "diagnosis")


@functools.cache
def channel(name: str) -> Channel:
    """The channel `name`. Raises KeyError, naming those that there are, where there is none.

    A channel is imported when it is asked for, so that a job depends on the code of its own channels alone.
    """
    if name not in NAMES:
        raise KeyError(f"no channel {name!r}: there are {', '.join(NAMES)}")
    found = importlib.import_module(f"{__name__}.{name}").CHANNEL
    assert isinstance(found, Channel)
    assert found.name == name
    return found


def every() -> tuple[Channel, ...]:
    """All channels, in the order of the list."""
    return tuple(channel(name) for name in NAMES)


def modules_of(names: Iterable[str]) -> list[str]:
    """Full names of the modules of channels: what a job that is told their names depends on."""
    return [f"{__name__}.{name}" for name in names]


def shown_modules() -> list[str]:
    """Full names of the modules in which channels say how they are shown."""
    found = (f"{__name__}.{name}.shown" for name in NAMES)
    return [module for module in found if importlib.util.find_spec(module) is not None]


def formerly(key: str) -> str:
    """The channel that files written before there were channels mean by `key`.

    Raises ValueError where it is no such key.
    """
    for one in every():
        if key in one.former:
            return one.name
    raise ValueError(f"there is no such key: {key}")
