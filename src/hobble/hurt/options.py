"""The keys of a data set's `hurt` section."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hobble.core.section import Section

TELLS = "injury"  # the channel that hurt versions are told
Severity = Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)]
Link = Annotated[str, Field(min_length=3)]


class Hurt(Section):
    """Hurt versions of the healthy clips, as further clips of the data set."""

    links: tuple[Link, ...] = Field((), description="links to hurt, as in status files; none: every link")
    severities: Annotated[tuple[Severity, ...], Field(min_length=1)] = Field(
        (3.0, 5.0, 7.0, 10.0),
        description="an injury has the highest for one half of its time and one of the others for the other",
    )
    versions: Annotated[int, Field(ge=0, le=9)] = Field(1, description="hurt versions of each healthy clip")
    at_once: Annotated[int, Field(ge=1, le=30)] = Field(2, description="links hurt at once, at most")
    seconds: Annotated[float, Field(ge=1, le=3600)] = Field(3.0, description="an injury lasts about so long")
    longest: Annotated[float, Field(gt=0, le=10)] = Field(
        0.9, description="length of a version of a clip of 6 seconds or more, relative to the clip's"
    )
    in_between: bool = Field(
        True,
        description="whether cycles are kept in which an injury sets in or goes, which show severities "
        "between those above",
    )
    seed: int = 1
