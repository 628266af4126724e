"""Makes hurt versions of healthy clips, modelled on the impaired walks of real people."""

from typing import Annotated

from pydantic import Field

from hobble.core.section import Section

HURT_CHANNEL = "injury"  # name of the channel that holds the severities of hurt versions
Severity = Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)]
Link = Annotated[str, Field(min_length=3)]


class Hurt(Section):
    """Adds hurt versions of the healthy clips to the data set, as further clips.

    A hurt version shows the motion of its clip as a person with injuries would move. An injury has a link
    (the bone between two joints) and a severity.
    """

    links: tuple[Link, ...] = Field(
        (), description="links to hurt, such as LeftUpLeg-LeftLeg (parent joint, child joint); empty: all"
    )
    severities: Annotated[tuple[Severity, ...], Field(min_length=1)] = Field(
        (3.0, 5.0, 7.0, 10.0),
        description="for half of its time an injury has the highest of these, for the other half another "
        "one; a short injury has only one of the two",
    )
    versions: Annotated[int, Field(ge=0, le=60)] = Field(1, description="hurt versions of each healthy clip")
    every: Annotated[int, Field(ge=1, le=60)] = Field(
        1,
        description="training uses every n-th frame of the hurt versions. If `versions` is n, too, training "
        "uses as many frames as one version has, but they show n times as many injuries",
    )
    at_once: Annotated[int, Field(ge=1, le=30)] = Field(
        2, description="largest number of links that are hurt at once"
    )
    seconds: Annotated[float, Field(ge=1, le=3600)] = Field(6.0, description="about how long an injury lasts")
    longest: Annotated[float, Field(gt=0, le=10)] = Field(
        0.9,
        description="greatest length of a hurt version relative to its healthy clip; later gait cycles are "
        "not used, except if the healthy clip is shorter than 6 seconds",
    )
    in_between: bool = Field(
        True,
        description="keep gait cycles in which a severity changes; false: keep only cycles in which each "
        "severity is 0 or one of the `severities`",
    )
    seed: int = 1  # of the random choice of what hurts when
