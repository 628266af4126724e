"""The `evaluation` stage: accuracy, responsivity and injury response, as JSON and CSV."""
