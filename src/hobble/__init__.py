"""Hobble: from motion capture to a character controller that limps the way the body would.

The function `results` of this package gives tables of results as data frames (`hobble.measures.results`).
"""

from __future__ import annotations

import importlib
from typing import Any


def __getattr__(name: str) -> Any:
    """The function `results`. It is imported at its first use, because pandas is slow to import."""
    if name == "results":
        return importlib.import_module("hobble.measures.results").results
    raise AttributeError(f"module 'hobble' has no attribute {name!r}")
