"""What is measured of a trained network: one folder a measurement, listed in `registry`."""
