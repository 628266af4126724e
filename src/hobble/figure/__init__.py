"""The body of a skeleton: one closed surface that the joint rotations move."""
