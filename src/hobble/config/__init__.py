"""Configurations, data sets and skeletons: YAML files, typed models, and clear error messages."""
