"""What becomes of a prediction from one frame to the next, as in the runtime of Holden et al. 2017.

Plain functions of numbers, numpy arrays or tensors: the runtime compiles them, roll-outs and training call
them. The page's JavaScript is the only other implementation. Compiled callers are kept on disk and renewed
when their own file changes: after a change here, delete the `__pycache__` beside them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

HALF = 0.5
ALWAYS = 0.1  # share of the predicted change of phase that a standing figure keeps


def met(carried: Any, predicted: Any) -> Any:
    """Where joints come to lie: half way between where velocities carry them and where they are predicted."""
    return HALF * (carried + predicted)


def moving(stand: Any) -> Any:
    """The share of its predicted movement that a figure makes; stand: the share of that gait, 0 to 1."""
    return np.maximum(0.0, 1.0 - stand) ** 0.25


def phase_change(share: Any, predicted: Any) -> Any:
    """Cycles that the phase goes on; share: of `moving`."""
    return ((1.0 - ALWAYS) * share + ALWAYS) * predicted
