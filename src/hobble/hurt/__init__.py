"""Healthy clips as a hurt body would have walked them: timing, steps, trunk and arms of real impaired walks."""
