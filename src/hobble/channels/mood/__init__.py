"""The mood channel. The mood of a clip is in its entry in the data set, or follows from its name."""

from hobble.channels.mood.channel import CHANNEL

__all__ = ["CHANNEL"]
