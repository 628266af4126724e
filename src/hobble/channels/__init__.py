"""What the body is told beside where to go: each channel in its own folder, injury the first."""
