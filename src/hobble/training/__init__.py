"""The `training` stage: network weights from a database."""
