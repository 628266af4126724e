"""What makes a rig's parts uncertain."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hobble.core.errors import InputError

MOST = 3.0  # cm: a clip whose height is more uncertain is refused


class Doubt(Exception):
    """What is uncertain about a rig. why: in words. roles: those that are certain, role -> joint."""

    def __init__(self, why: str, roles: dict[str, int] | None = None) -> None:
        super().__init__(why)
        self.roles = roles or {}


class TwoFigures(Doubt):
    """A rig with more than one body."""


def check_height(path: Path, error: float, notes: Sequence[str], accept: bool) -> None:
    """Raise InputError if the height of a figure is too uncertain.

    error: cm (two standard deviations). notes: what is uncertain, in sentences. accept: take the
    clip anyway.
    """
    if error > MOST and not accept:
        raise InputError(
            path,
            " ".join(notes),
            fix="Use a clip in which both feet stand flat or whose zero pose stands, or accept this with "
            "motion.accept_doubt: true.",
        )
