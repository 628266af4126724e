"""The character at run time. A game calls `ProceduralAnimation`, which returns one pose for each frame."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from hobble.core.section import PhaseMode, PositiveFloat, Section

if TYPE_CHECKING:
    from hobble.runtime.animation import Pose, ProceduralAnimation

__all__ = ["Pose", "ProceduralAnimation"]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used.

    Every job of Snakemake imports this file for the keys. So it must not import the animation: the job would
    have to wait for numpy and numba.
    """
    if name in __all__:
        return getattr(importlib.import_module("hobble.runtime.animation"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


class Runtime(Section):
    """Options of the character at run time."""

    mode: PhaseMode = Field(
        "cubic",
        description="how the network's weights follow from the phase: cubic is exact, linear blends weights "
        "stored at 10 phases, constant takes the weights stored at one of 50 phases",
    )
    rates: dict[str, PositiveFloat] = Field(
        {},
        description="for each channel, the largest change of its values per second; default: the channel's "
        "own rate",
    )
    scales: dict[str, PositiveFloat] = Field(
        {}, description="for each channel, a number by which its values are divided; default: 1"
    )
    foot_locking: bool = Field(True, description="hold feet in contact where they landed")
    limits: bool = Field(True, description="limit the target speed to what the hurt or sad body can do")
    steering: Annotated[float, Field(ge=0)] = Field(
        2.0,
        description="gain with which the target velocity is corrected while the character does not reach it; "
        "0: no correction, as in the runtime of Holden et al. (2017)",
    )
