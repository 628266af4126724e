"""Ground under the clips: heightmaps, patches cut from them, and the ten patches that fit each cycle best."""
