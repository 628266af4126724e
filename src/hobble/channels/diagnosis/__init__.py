"""The diagnosis channel. A table lists the diagnosis of the person in each recording."""

from hobble.channels.diagnosis.channel import CHANNEL

__all__ = ["CHANNEL"]
