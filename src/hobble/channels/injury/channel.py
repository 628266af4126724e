"""The injury channel: a severity from 0 to 10 for each link (pair of neighbouring joints)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from hobble.channels.channel import Channel, ClipSource, HasLinks
from hobble.core.untrusted import MAX_TEXT_BYTES, read_bytes

if TYPE_CHECKING:
    from hobble.core.clip import Clip
    from hobble.core.quat import Array

ZERO = re.compile(r"\s*0+(\.0*)?\s*")  # a severity of 0, such as "0" or "0.00"


def hurts(text: str) -> bool:
    """Whether a text has a severity above 0. text: a status (`A-B[4];`) or the content of a status file."""
    return any(ZERO.fullmatch(severity) is None for severity in re.findall(r"\[([^\]]*)", text))


class Injury(Channel):
    """Severities from a status file beside the clip. For the class fields see `Channel`.

    If the clip's entry in the data set has a status, it is used instead and holds for all frames.
    """

    name = "injury"
    title = "Injury"
    value = "severity"
    highest = 10.0
    rate = 10.0  # severity per second: from healthy to the highest severity in one second
    suffix = "_injuries.txt"
    old_keys = ("links", "injury", "status", "severity")
    slows = True
    targets = ("questionnaire",)  # the page on which people tick what hurts in films of the character

    def columns(self, rig: HasLinks) -> tuple[str, ...]:
        """The links, with names such as "LeftUpLeg-LeftLeg"."""
        return tuple(f"{a}-{b}" for a, b in rig.links)

    def is_neutral(self, source: ClipSource) -> bool:
        """Whether no status has a severity above 0."""
        if source.value is not None:
            return not hurts(str(source.value))
        return not any(hurts(read_bytes(file, MAX_TEXT_BYTES).decode("latin-1")) for file in source.files)

    def check(self, source: ClipSource, rig: HasLinks) -> None:
        """Raise InputError if the entry's status breaks the grammar of status files.

        A skeleton without links has no columns for severities. Then the status only marks the clip as hurt:
        a network without this channel does not train on it.
        """
        from hobble.channels.injury.status import parse_links
        from hobble.core.errors import InputError

        if source.value is None:
            return
        where = f"{source.clip}.channels.{self.name}"
        if not isinstance(source.value, str):
            raise InputError(where, "is not a text", fix="Write Joint-Joint[severity];")
        if links := self.columns(rig):
            parse_links(source.value, links, where)

    def read(self, clip: Clip, source: ClipSource, motion: Mapping[str, Any]) -> tuple[Array, list[str]]:
        """Severities (F, L) float32 of F frames and L links, and warnings."""
        from hobble.channels.injury.severity import clip_severity

        return clip_severity(clip, next(iter(source.files), None), source.value, motion)

    def mirror(self, values: Array, rig: Any) -> Array:
        """Swap left and right."""
        from hobble.channels.injury.severity import mirror_severity

        return mirror_severity(values, rig.mirror_links)


CHANNEL = Injury()
