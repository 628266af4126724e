"""The error for a rig whose body parts are uncertain, and a check that a figure's height is certain."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hobble.core.errors import InputError

MOST_HEIGHT_ERROR = 3.0  # cm (two standard deviations): a clip whose height is more uncertain is refused


class Doubt(Exception):
    """It is uncertain which joints of a rig are which parts of the body.

    why: what is uncertain, in words. certain_roles: role, such as left_knee -> index of the joint that surely
    has it.
    """

    def __init__(self, why: str, certain_roles: dict[str, int] | None = None) -> None:
        super().__init__(why)
        self.certain_roles = certain_roles or {}


class TwoFigures(Doubt):
    """A rig with more than one body."""


def check_height(path: Path, error: float, doubts: Sequence[str], accept: bool) -> None:
    """Raise InputError if the height of a figure is too uncertain.

    error: by how many cm the height may be off (two standard deviations). doubts: what is uncertain, in
    sentences. accept: take the clip anyway.
    """
    if error > MOST_HEIGHT_ERROR and not accept:
        raise InputError(
            path,
            " ".join(doubts),
            fix="Use a clip in which both feet stand flat, or one with a zero pose (all rotations zero) in "
            "which a person could stand. To use this clip anyway, set motion.accept_doubt: true.",
        )
