"""Channels. A channel is an input of the network besides motion and ground, such as an injury."""

import functools
import importlib
import importlib.util

from hobble.channels.channel import Channel

# The names of all channels. Each is also a package in this folder, whose CHANNEL is an instance of `Channel`.
CHANNEL_NAMES = ("injury", "guarding", "mood", "diagnosis")


@functools.cache
def channel(name: str) -> Channel:
    """The channel `name`. Raises KeyError with all names if there is no such channel.

    The channel's package is imported only here. So a job of the workflow depends only on the code of the
    channels that it uses.
    """
    if name not in CHANNEL_NAMES:
        raise KeyError(f"there is no channel {name!r}. The channels are {', '.join(CHANNEL_NAMES)}")
    definition: Channel = importlib.import_module(f"{__name__}.{name}").CHANNEL
    return definition


def all_channels() -> tuple[Channel, ...]:
    """All channels, in the order of CHANNEL_NAMES."""
    return tuple(channel(name) for name in CHANNEL_NAMES)


def display_modules() -> list[str]:
    """Full names of the modules channels.<name>.shown that exist.

    Such a module says how a page shows the channel. A channel without it is shown in the default way.
    """
    modules = (f"{__name__}.{name}.shown" for name in CHANNEL_NAMES)
    return [module for module in modules if importlib.util.find_spec(module) is not None]
