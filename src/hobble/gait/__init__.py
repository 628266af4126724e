"""Compares a walk with a healthy one: its cycles, the sizes of effects, and which limp of people it
resembles.
"""
