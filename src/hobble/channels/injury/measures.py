"""What is measured of a character that can be hurt, in its order."""

from hobble.channels.injury import recognition, response

MEASURES = (response.MEASURE, recognition.MEASURE)
