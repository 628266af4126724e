"""The measurements of the mood channel."""

from hobble.channels.mood import response

MEASURES = (response.MEASURE,)
