"""What the body is told beside where to go: each channel in a folder of its own, named in the list below."""

from __future__ import annotations

import functools
import importlib

from hobble.channels.channel import Channel, Source

__all__ = ["NAMES", "Channel", "Source", "channel", "every", "formerly"]

# Every channel that there is: the folder NAME beside this file, whose package has the channel as CHANNEL.
NAMES = ("injury",)


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


def formerly(key: str) -> str:
    """The channel that files written before there were channels mean by `key`.

    Raises ValueError where it is no such key.
    """
    for one in every():
        if key in one.former:
            return one.name
    raise ValueError(f"there is no such key: {key}")
