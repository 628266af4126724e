"""Measurements of a trained network, and the comparison of configurations.

A measurement is two files. `<name>.py` holds MEASURE (`hobble.measures.measure.Measure`), the class of its
options and what is shown of it; `<name>_run.py` measures. Planning imports `<name>.py`, so it must not import
anything slow, and `<name>_run.py` does not import it, so that a change of the page measures nothing again.
"""
