"""The `evaluation` stage: accuracy, responsivity and the rest, as JSON and CSV."""
