"""Measurements of a trained network: one folder for each, listed in `registry`."""
