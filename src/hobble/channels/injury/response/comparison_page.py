"""Shows the response to injury of several configurations side by side, in one table."""

from __future__ import annotations

from typing import Any

from hobble.report.comparison_charts import Compared
from hobble.report.page_parts import PageSection, Paragraph, SectionPart
from hobble.report.tables import Column, Table

INTRODUCTION = (
    "The character walks or jogs while one link is hurt, from severity 0 to 10 and back. Each value is the "
    "mean over the links that were hurt in training. ρ is Spearman's rank correlation: 1 means that the "
    "measure always rises with severity, −1 that it always falls, 0 that it does neither."
)
# Key of a summary in injury.json -> words for it.
WORDS = {
    "from_healthy_cm": "distance from the healthy pose at severity 10, cm per joint",
    "speed_share": "share of the healthy speed at severity 10",
    "spearman_from_healthy": "ρ of pose and severity",
    "spearman_speed": "ρ of speed and severity",
    "spearman_falling_from_healthy": "ρ of pose and severity, while severity falls",
    "settle_seconds": "time to settle, s",
    "heal_seconds": "time to heal, s",
    "after_healing_cm": "remaining distance after healing, cm per joint",
    "hysteresis_cm": "difference between rising and falling severity, cm per joint",
    "acceleration_share": "largest acceleration, share of the healthy walk's",
    "clip_acceleration_share": "largest acceleration, share of the captured clips'",
}


def section(compared: Compared) -> PageSection:
    """A table of means, if the character of any configuration can be hurt. compared: from compare.json."""
    table = injury_table(compared)
    words = Paragraph(INTRODUCTION) if table else None
    parts = [SectionPart(0, words), SectionPart(10, table, open=True, short=True)]
    return PageSection("injury", parts, title="Injury response", at=20)


def injury_table(compared: Compared) -> Table | None:
    """A row for each measure, and a column for each gait of each configuration with injuries."""
    rows = [
        (entry["configuration"], gait, summary)
        for entry in compared["injury"]
        if entry.get("applies")
        for gait, summary in (entry.get("summary") or {}).items()
    ]
    if not rows:
        return None
    found = {key for *_, summary in rows for key in summary}
    keys = [*(key for key in WORDS if key in found), *sorted(found - set(WORDS))]
    columns = [Column("measure"), *(Column.number(f"{name}, {gait}") for name, gait, _ in rows)]
    table: list[list[Any]] = [
        [WORDS.get(key, key.replace("_", " ")), *(summary.get(key) for *_, summary in rows)] for key in keys
    ]
    shares = {
        e["configuration"]: e["generated"]["right"] for e in compared["recognition"] if e.get("applies")
    }
    if shares:
        row = [
            "share of hurt parts that a classifier recognises",
            *(shares.get(name) for name, *_ in rows),
        ]
        table.append(row)
    return Table("compare-injury", columns, table, "Means over the links that were hurt in training")
