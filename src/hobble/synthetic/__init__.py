"""The data set `synthetic`: clips of a procedural walker, written like a user's folder of clips."""
