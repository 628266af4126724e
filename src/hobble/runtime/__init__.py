"""The character at run time. A game uses `ProceduralAnimation`, which returns one pose a frame."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hobble.runtime.animation import Pose, ProceduralAnimation

__all__ = ["Pose", "ProceduralAnimation"]


def __getattr__(name: str) -> Any:
    """Import the public names on first use.

    Every job of Snakemake imports the options in this package, and should not wait for numpy and numba.
    """
    if name in __all__:
        return getattr(importlib.import_module("hobble.runtime.animation"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
