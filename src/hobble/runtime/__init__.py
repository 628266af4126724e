"""The character at run time. A game calls `ProceduralAnimation`, which returns one pose for each frame."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hobble.runtime.animation import Pose, ProceduralAnimation

__all__ = ["Pose", "ProceduralAnimation"]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used.

    Every job of Snakemake imports the module `options` of this package. So this file must not import the
    animation: the job would have to wait for numpy and numba.
    """
    if name in __all__:
        return getattr(importlib.import_module("hobble.runtime.animation"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
