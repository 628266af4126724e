"""The `database` stage: rows of X, Y and P from clips, labels, channels and terrain fits."""
