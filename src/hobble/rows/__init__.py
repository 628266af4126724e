"""Rows of training data: input X, output Y and phase P of the network, for one frame of a clip."""
