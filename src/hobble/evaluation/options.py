"""The keys of a configuration's `evaluation` section."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from hobble.core.section import PhaseMode, Positive, PositiveFloat, Section


def _some(lengths: tuple[int, ...]) -> tuple[int, ...]:
    """At least one length: of none there is nothing to measure."""
    if not lengths:
        raise ValueError("must name at least one number of frames")
    return lengths


class Evaluation(Section):
    """The measurements."""

    joints: Literal["all", "equivalent"] = Field(
        "all", description="`equivalent`: only the joints that the 31-joint skeleton has too"
    )
    rollouts: Annotated[tuple[Positive, ...], AfterValidator(_some)] = Field(
        (1, 10, 60, 300), description="frames for which the network is fed its own pose"
    )
    laps: Positive = 19
    lap_seconds: Annotated[float, Field(ge=1, allow_inf_nan=False)] = Field(
        400.0, description="a lap that takes longer is ended there"
    )
    modes: tuple[PhaseMode, ...] = Field(
        ("constant", "linear", "cubic"),
        description="phase modes that laps are run in, beside the runtime's own",
    )
    seconds: PositiveFloat = Field(4.0, description="at each severity of the injury sweeps")
