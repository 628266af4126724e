"""The `database` stage: rows of X, Y and P from clips, labels, injuries and terrain fits."""
