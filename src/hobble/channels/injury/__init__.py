"""The injury channel: status files and the severity of each link in each frame."""

from hobble.channels.injury.channel import CHANNEL

__all__ = ["CHANNEL"]
