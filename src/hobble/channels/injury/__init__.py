"""What hurts, and how much: status files, and the severity of each link in each frame."""
