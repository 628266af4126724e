"""The command `hobble`, for single clips and networks outside the workflow."""
