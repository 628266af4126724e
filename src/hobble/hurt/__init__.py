"""Healthy clips as a hurt body would have walked them, after the impaired walks of real people."""
