"""The `evaluation` stage: what measurements share, and the comparison of configurations."""
