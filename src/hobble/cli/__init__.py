"""The command `hobble`: what can be done with single clips and networks, beside the workflow."""
