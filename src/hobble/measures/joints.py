"""Which joints a measurement is over."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from hobble.core.section import Section


class Joints(Section):
    """A key that measurements of joint positions share."""

    joints: Literal["all", "equivalent"] = Field(
        "all", description="`equivalent`: only the joints that the 31-joint skeleton has too"
    )
