"""Configurations, data sets and skeletons: YAML layers, typed models, readable refusals."""
