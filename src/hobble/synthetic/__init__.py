"""Makes synthetic clips: motion of a procedural walker, written like the clips in a user's folder."""
