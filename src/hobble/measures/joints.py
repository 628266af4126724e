"""The option that selects the joints to measure."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from hobble.core.section import Section


class JointOptions(Section):
    """The option `joints`, which all measurements of joint positions have."""

    joints: Literal["all", "equivalent"] = Field(
        "all",
        description="`equivalent`: only the joints that have a counterpart on the skeleton holden31",
    )
