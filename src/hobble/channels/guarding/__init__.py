"""The guarding channel: how much the whole body spares what hurts, from 0 to 1.

People who act pain guard with the whole body (1). People who have long lived with an injury hardly do (0). A
body that does not hurt moves in the same way at every value. A network learns this, because every clip has a
value.
"""

import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from hobble.channels.channel import ClipChannel, ClipSource, HasLinks
from hobble.core.clip import Clip
from hobble.core.clip_files import MIRROR_SUFFIX
from hobble.core.declared import read_declared
from hobble.core.quat import Array

GOLDEN = (math.sqrt(5) - 1) / 2
Amount = Annotated[float, Field(ge=0, le=1)]
Course: Any = tuple[list[float], list[Amount]]  # frames, and the values between which the guarding changes


def guarding_of_clip(name: str, stretch: int = 0) -> float:
    """How much the body guards in a clip, or in one of its stretches, if its entry does not say so.

    The values of clips with different names are spread over 0 to 1, two thirds of them within .15 of an end,
    because a network learns most from these. A clip and its mirror have the same value.
    """
    value = math.modf((zlib.crc32(name.removesuffix(MIRROR_SUFFIX).encode()) + stretch) * GOLDEN)[0]
    for _ in range(2):  # towards the ends
        value = 0.5 - 0.5 * math.cos(math.pi * value)
    return value


class Guarding(ClipChannel):
    """Has one column. The clip's entry in the data set may give its value, else it is `guarding_of_clip`."""

    name = "guarding"
    title = "Guarding"
    value_word = "amount"
    highest = 1.0
    rate = 1.0
    default = 0.6
    # An effect of guarding grows with this power of it (GUARD_CHANGES in `hobble.hurt.effects`).
    exponent = 3.6
    Value = Amount

    def columns(self, rig: HasLinks) -> tuple[str, ...]:
        """The only column."""
        return ("guarding",)

    def is_neutral(self, source: ClipSource) -> bool:
        """Always. A network without this channel may train on any clip."""
        return True

    def values_of(self, source: ClipSource) -> Sequence[float]:
        """As in `ClipChannel`."""
        return [guarding_of_clip(source.clip) if source.value is None else source.value]

    def read(self, clip: Clip, source: ClipSource, motion: Mapping[str, Any]) -> tuple[Array, list[str]]:
        """As in `ClipChannel`. In a hurt version the value changes: its report has `guarding`, its course."""
        if course := motion.get(self.name):
            frames, values = read_declared(f"{clip.name}.{self.name}", "the course", Course, course)
            return np.interp(np.arange(len(clip)), frames, values).astype(np.float32)[:, None], []
        return super().read(clip, replace(source, clip=clip.name), motion)


CHANNEL = Guarding()
