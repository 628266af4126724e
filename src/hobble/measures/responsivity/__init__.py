"""Measures laps of a waypoint track: the time of a frame, and how closely the character follows the track.

The laps are repeated in each phase mode. A phase mode is a way to evaluate the network, such as cubic
interpolation over the phase.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from hobble.core.section import PhaseMode, Positive, Section
from hobble.measures.measure import Cost, Measure
from hobble.runtime.options import Runtime


class Options(Section):
    """The keys of this measurement in a configuration's section `evaluation`."""

    laps: Positive = Field(19, description="laps in the phase mode of the section `runtime`")
    laps_other_modes: Positive = Field(
        3, description="at most this many laps in each other phase mode; a small number saves time"
    )
    lap_seconds: Annotated[float, Field(ge=1, allow_inf_nan=False)] = Field(
        400.0, description="seconds after which a lap is stopped"
    )
    modes: tuple[PhaseMode, ...] = Field(
        ("constant", "linear", "cubic"),
        description="phase modes to measure in addition to the one in the section `runtime`",
    )


def pieces(options: Options, runtime: Runtime, modes: Sequence[str]) -> tuple[str, ...]:
    """The names of this measurement's pieces. Each piece is the laps in one phase mode, named after the mode.

    modes: all phase modes of the network. If there is only one, it is the only piece.
    """
    return tuple(dict.fromkeys((*options.modes, runtime.mode))) if len(modes) > 1 else tuple(modes)


MEASURE = Measure(
    name="responsivity",
    package=__name__,
    inputs=("weights",),
    options=Options,
    runtime=tuple(Runtime.model_fields),
    pieces=pieces,
    cost=Cost(memory_mb=200, least_minutes=60),
)
