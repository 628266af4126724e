"""The body that a skeleton wears: one closed surface, which the joints' rotations move, and glTF files of it."""
