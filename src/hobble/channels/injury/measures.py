"""What is measured of a character that can be hurt, in its order."""

from hobble.channels.injury import limp, recognition, response

MEASURES = (response.MEASURE, limp.MEASURE, recognition.MEASURE)
