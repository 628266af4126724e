"""Ground under the clips: heightmaps, patches drawn from them, and the ten that fit each locomotion cycle."""
