"""The mood channel. Moods come from the names of clips."""

from hobble.channels.mood.channel import CHANNEL

__all__ = ["CHANNEL"]
