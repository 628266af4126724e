"""The error for a rig whose parts are uncertain, and a check that a figure's height is certain enough."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hobble.core.errors import InputError

MOST_HEIGHT_ERROR = 3.0  # cm (two standard deviations): a clip whose height is more uncertain is refused


class Doubt(Exception):
    """The parts of a rig are uncertain.

    why: what is uncertain, in words. certain_roles: role -> joint, for the roles that are certain.
    """

    def __init__(self, why: str, certain_roles: dict[str, int] | None = None) -> None:
        super().__init__(why)
        self.certain_roles = certain_roles or {}


class TwoFigures(Doubt):
    """A rig with more than one body."""


def check_height(path: Path, error: float, notes: Sequence[str], accept: bool) -> None:
    """Raise InputError if the height of a figure is too uncertain.

    error: of the height, cm (two standard deviations). notes: what is uncertain, in sentences. accept: take
    the clip anyway.
    """
    if error > MOST_HEIGHT_ERROR and not accept:
        raise InputError(
            path,
            " ".join(notes),
            fix="Use a clip in which both feet stand flat, or one in whose zero pose a person could stand. "
            "To use this clip anyway, set motion.accept_doubt: true.",
        )
