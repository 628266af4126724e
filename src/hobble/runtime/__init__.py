"""The character at run time: the next pose, every frame. `ProceduralAnimation` is what a game takes."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hobble.runtime.animation import Pose, ProceduralAnimation

__all__ = ["Pose", "ProceduralAnimation"]


def __getattr__(name: str) -> Any:
    """What the package offers, imported when it is first asked for.

    Snakemake reads the options of this package for every job, and need not wait for numpy and numba.
    """
    if name in __all__:
        return getattr(importlib.import_module("hobble.runtime.animation"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
