"""The mood that the body is in, by the names of clips: one actor's recordings say it there."""

from hobble.channels.mood.channel import CHANNEL

__all__ = ["CHANNEL"]
