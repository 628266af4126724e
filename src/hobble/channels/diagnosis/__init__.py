"""What a patient has, by a table of the recordings: the whole body walks by it, wherever it sits."""

from hobble.channels.diagnosis.channel import CHANNEL

__all__ = ["CHANNEL"]
