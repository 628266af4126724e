"""What makes a rig's parts uncertain."""

from __future__ import annotations


class Doubt(Exception):
    """What is uncertain about a rig. why: in words. roles: those that are certain, role -> joint."""

    def __init__(self, why: str, roles: dict[str, int] | None = None) -> None:
        super().__init__(why)
        self.roles = roles or {}


class TwoFigures(Doubt):
    """A rig with more than one body."""
