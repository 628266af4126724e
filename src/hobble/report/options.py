"""The keys of a configuration's `report` section."""

from __future__ import annotations

from hobble.core.section import Section


class ReportOptions(Section):
    """The report page. title: its heading, instead of the default heading."""

    title: str | None = None
