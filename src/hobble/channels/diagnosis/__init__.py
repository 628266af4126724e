"""The diagnosis channel. A patient's diagnosis comes from a table of the recordings."""

from hobble.channels.diagnosis.channel import CHANNEL

__all__ = ["CHANNEL"]
