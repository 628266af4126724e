"""Labels a clip with contacts, phase and gait, from hand-made files or from the motion alone."""
