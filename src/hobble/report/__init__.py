"""The report of a configuration: one HTML file to read and to play with."""
