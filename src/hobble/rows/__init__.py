"""Rows of X, Y and P: their layout, the rows of a clip, and how a row is composed."""
