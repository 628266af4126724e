"""The data set of the small project of `conftest.base`."""

DATASET = """
skeleton: s
folder: mine
mirror: true
held_out: [b]
"""
