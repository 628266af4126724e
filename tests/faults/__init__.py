"""Faults thrown at the workflow, and what a stranger's files may not do: `make faults N=200` throws more."""
