"""Rows of X, Y and P: their blocks by name, a clip's rows, and how a row is put together."""
