"""The keys of a configuration's `report` section."""

from __future__ import annotations

from hobble.core.section import Section


class ReportOptions(Section):
    """The page."""

    title: str | None = None
