"""The measurements of the injury channel, in the order of the report."""

from hobble.channels.injury import limp, recognition, response

MEASURES = (response.MEASURE, limp.MEASURE, recognition.MEASURE)
