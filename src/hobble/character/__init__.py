"""The rule by which a character goes on from one frame to the next."""
