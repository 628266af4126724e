"""Measures how a walk differs from a healthy walk, and recognises which impairment it resembles."""
