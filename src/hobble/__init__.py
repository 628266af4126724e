"""Hobble: from motion capture to a character controller that limps the way the body would.

    from hobble import load

    character = load("results/injured/network")
    pose = character.next_pose((0, 2.5), injury={"LeftUpLeg-LeftLeg": 7})

The function `results` of this package gives tables of results as data frames (`hobble.report.gather`).
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hobble.runtime.animation import ProceduralAnimation


def load(path: str | Path, **options: Any) -> ProceduralAnimation:
    """Load a trained character. path: the folder `network` of its results, or an exported file.

    options: those of `hobble.runtime.ProceduralAnimation.load`.
    """
    # No `import`: every job of the workflow imports hobble, and would depend on the runtime.
    animation = importlib.import_module("hobble.runtime.animation")
    character: ProceduralAnimation = animation.ProceduralAnimation.load(path, **options)
    return character


def __getattr__(name: str) -> Any:
    """`results` and `__version__`. They are imported at their first use, because that is slow."""
    if name == "results":
        return importlib.import_module("hobble.report.gather").results
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version("hobble")
    raise AttributeError(f"module 'hobble' has no attribute {name!r}")
