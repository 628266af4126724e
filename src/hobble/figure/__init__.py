"""The body around a skeleton: one closed surface, which moves with the joints."""
