"""The option that selects the joints to measure."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from hobble.core.section import Section


class Joints(Section):
    """An option of all measurements of joint positions."""

    joints: Literal["all", "equivalent"] = Field(
        "all", description="`equivalent`: only the joints that the 31-joint skeleton has too"
    )
