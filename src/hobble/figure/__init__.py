"""The body that a skeleton wears: one closed surface, moved by its joints' rotations."""
