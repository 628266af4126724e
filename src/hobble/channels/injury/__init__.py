"""The injury channel: how much each link of the body hurts, from 0 to 10, in each frame.

A link is a pair of neighbouring joints. A status file beside a clip says which links hurt in it, and when.
"""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from hobble.channels.channel import Channel, ClipSource, HasLinks
from hobble.channels.injury.status import clip_severity, parse_links
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.files import MAX_TEXT_BYTES, read_bytes
from hobble.core.quat import Array

ZERO = re.compile(r"\s*0+(\.0*)?\s*")  # matches a severity of 0, such as "0" or "0.00"


def has_injury(text: str) -> bool:
    """Whether a text states a severity above 0.

    text: the content of a status file, or a status such as `A-B[4];`, which gives the link from joint A to
    joint B the severity 4.
    """
    return any(ZERO.fullmatch(severity) is None for severity in re.findall(r"\[([^\]]*)", text))


class Injury(Channel):
    """Reads severities from the status file beside a clip. For the class fields see `Channel`.

    If the clip's entry in the data set has a status, the file is not used. The entry's status holds for all
    frames.
    """

    name = "injury"
    title = "Injury"
    value_word = "severity"
    highest = 10.0
    rate = 10.0  # severity per second: from healthy to the highest severity in one second
    suffix = "_injuries.txt"
    slows = True
    # The effects of an injury grow with this power of the severity: to .60 at 3, .75 at 5, .86 at 7.
    exponent = 0.42
    targets = ("questionnaire",)  # a page on which people watch films of the character and tick what hurts

    def columns(self, rig: HasLinks) -> tuple[str, ...]:
        """Names of the L links, such as "LeftUpLeg-LeftLeg"."""
        return tuple(f"{a}-{b}" for a, b in rig.links)

    def is_neutral(self, source: ClipSource) -> bool:
        """Whether no link hurts in any frame."""
        if source.value is not None:
            return not has_injury(str(source.value))
        return not any(
            has_injury(read_bytes(file, MAX_TEXT_BYTES).decode("latin-1")) for file in source.files
        )

    def check(self, source: ClipSource, rig: HasLinks) -> None:
        """Raise InputError if the entry's status breaks the grammar of status files.

        If the skeleton has no links, the channel has no columns and the status is not parsed. It then only
        marks the clip as hurt, so that networks without this channel do not train on the clip.
        """
        if source.value is None:
            return
        where = f"{source.clip}.channels.{self.name}"
        if not isinstance(source.value, str):
            raise InputError(where, "is not a text", fix="Write a status such as LeftUpLeg-LeftLeg[4];")
        if links := self.columns(rig):
            parse_links(source.value, links, where)

    def read(self, clip: Clip, source: ClipSource, motion: Mapping[str, Any]) -> tuple[Array, list[str]]:
        """Severities (F, L) float32 of F frames and L links, and warnings."""
        return clip_severity(clip, next(iter(source.files), None), source.value, motion)

    def mirror(self, values: Array, rig: Any) -> Array:
        """Severities (F, L) of the mirrored clip. The severities of left and right links are swapped."""
        return np.ascontiguousarray(values[:, rig.mirror_links])


CHANNEL = Injury()
