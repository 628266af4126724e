"""The keys of a data set's `hurt` section."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hobble.core.section import Section

HURT_CHANNEL = "injury"  # name of the channel that holds the severities of hurt versions
Severity = Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)]
Link = Annotated[str, Field(min_length=3)]


class Hurt(Section):
    """Hurt versions of the healthy clips, as further clips of the data set."""

    links: tuple[Link, ...] = Field((), description="links to hurt, named as in status files; empty: all")
    severities: Annotated[tuple[Severity, ...], Field(min_length=1)] = Field(
        (3.0, 5.0, 7.0, 10.0),
        description="an injury has the highest of these for half of its time, and another for the other half",
    )
    versions: Annotated[int, Field(ge=0, le=9)] = Field(1, description="hurt versions of each healthy clip")
    every: Annotated[int, Field(ge=1, le=9)] = Field(
        1,
        description="training uses every n-th frame of the hurt versions; with n `versions` it uses as many "
        "frames as one version has, but they show n times as many injuries",
    )
    at_once: Annotated[int, Field(ge=1, le=30)] = Field(
        2, description="largest number of links that are hurt at once"
    )
    seconds: Annotated[float, Field(ge=1, le=3600)] = Field(6.0, description="about how long an injury lasts")
    longest: Annotated[float, Field(gt=0, le=10)] = Field(
        0.9, description="greatest length of a version relative to its clip, for clips of 6 seconds or more"
    )
    in_between: bool = Field(
        True,
        description="keep cycles in which an injury sets in or fades; false: only cycles at 0 or at one "
        "of the `severities`",
    )
    seed: int = 1
