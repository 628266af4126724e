"""Compares a walk with a healthy one: its cycles, the sizes of effects, and the impairment it resembles."""
