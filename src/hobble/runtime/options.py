"""The keys of a configuration's `runtime` section."""

from typing import Annotated

from pydantic import Field

from hobble.core.section import PhaseMode, PositiveFloat, Section


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
