"""What is measured of a character that has moods."""

from hobble.channels.mood import response

MEASURES = (response.MEASURE,)
