"""The channel: severities from 0 to 10, one for each link of the skeleton."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from hobble.channels.channel import Channel, Rig, Source
from hobble.core.untrusted import MAX_TEXT_BYTES, read_bytes

if TYPE_CHECKING:
    from hobble.core.clip import Clip
    from hobble.core.quat import Array

NOTHING = re.compile(r"\s*0+(\.0*)?\s*")


def hurts(text: str) -> bool:
    """Whether a status (`A-B[4];`), or the text of a status file, has a severity other than 0."""
    return any(NOTHING.fullmatch(severity) is None for severity in re.findall(r"\[([^\]]*)", text))


class Injury(Channel):
    """What hurts: a status file beside the clip, or a status in its entry that holds for all its frames."""

    name = "injury"
    title = "Injury"
    value = "severity"
    highest = 10.0
    rate = 10.0
    suffix = "_injuries.txt"
    former = ("links", "injury", "status", "severity")
    slows = True
    targets = ("questionnaire",)

    def columns(self, rig: Rig) -> tuple[str, ...]:
        """The links: "LeftUpLeg-LeftLeg"."""
        return tuple(f"{a}-{b}" for a, b in rig.links)

    def is_neutral(self, source: Source) -> bool:
        """Whether no status has a severity above 0."""
        if source.value is not None:
            return not hurts(str(source.value))
        return not any(hurts(read_bytes(file, MAX_TEXT_BYTES).decode("latin-1")) for file in source.files)

    def check(self, source: Source, rig: Rig) -> None:
        """The status of an entry has to follow the grammar of a status file.

        Where the skeleton names no links it only says that the clip is hurt, so that it is left out.
        """
        from hobble.channels.injury.status import parse_links
        from hobble.core.errors import InputError

        if source.value is None:
            return
        where = f"{source.clip}.channels.{self.name}"
        if not isinstance(source.value, str):
            raise InputError(where, "is no text", fix="Write Joint-Joint[severity];")
        if links := self.columns(rig):
            parse_links(source.value, links, where)

    def read(self, clip: Clip, source: Source, motion: Mapping[str, Any]) -> tuple[Array, list[str]]:
        """See `clip_severity`."""
        from hobble.channels.injury.severity import clip_severity

        return clip_severity(clip, next(iter(source.files), None), source.value, motion)

    def mirror(self, values: Array, rig: Any) -> Array:
        """What hurt on the left hurts on the right."""
        from hobble.channels.injury.severity import mirror_severity

        return mirror_severity(values, rig.mirror_links)


CHANNEL = Injury()
