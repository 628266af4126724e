"""Faults in the workflow, and hostile files. `make faults N=200` makes more of them."""
