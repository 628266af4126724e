"""Makes synthetic clips: motion of a procedural walker, written like the files in a user's folder."""
