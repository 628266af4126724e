"""The report of a configuration: one HTML file to read and to play with."""

from __future__ import annotations

from hobble.core.section import Section


class ReportOptions(Section):
    """The keys of a configuration's `report` section. title: the page's heading, instead of the default."""

    title: str | None = None
