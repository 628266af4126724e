"""The embedded data set: a procedural walker, healthy or hurt, written like a user's folder."""
