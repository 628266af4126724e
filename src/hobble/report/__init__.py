"""The report of a configuration: one HTML file to read and to play with."""

from typing import Literal

from pydantic import Field

from hobble.core.section import Section


class ReportOptions(Section):
    """The keys of a configuration's `report` section."""

    title: str | None = Field(None, description="the page's heading, instead of the default")
    parts: Literal["published", "sided"] = Field(
        "published",
        description="parts that people can tick in the questionnaire: the five of Ferre et al. (2019), or "
        "twelve, of the left and the right side",
    )
