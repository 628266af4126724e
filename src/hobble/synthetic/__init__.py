"""The embedded data set: a procedural walker, healthy and hurt, written as a user's folder would hold it."""
