"""Shows the response to injury of several configurations side by side, in one table.

A configuration names the data and the settings of one character. A link is the piece of the body between two
neighbouring joints.
"""

from __future__ import annotations

from typing import Any

from hobble.report.parts import Column, Compared, PageSection, Paragraph, SectionPart, Table

INTRODUCTION = (
    "The character walks or jogs while the severity of one link (the piece of the body between two "
    "neighbouring joints) rises from 0 to 10 and falls again. Each value is a mean over the links that were "
    "hurt in training, except the share that a classifier recognises. ρ is Spearman's rank correlation: "
    "1 means that the measure always rises with severity, −1 that it always falls, 0 that it has no trend."
)
# Key of a summary in injury.json -> label of its row.
ROW_LABELS = {
    "from_healthy_cm": "distance from the healthy walk at severity 10, cm per joint",
    "speed_share": "share of the healthy speed at severity 10",
    "spearman_from_healthy": "ρ of pose and severity",
    "spearman_speed": "ρ of speed and severity",
    "spearman_falling_from_healthy": "ρ of pose and severity, while severity falls",
    "settle_seconds": "time to settle, s",
    "heal_seconds": "time to heal, s",
    "after_healing_cm": "remaining distance after healing, cm per joint",
    "hysteresis_cm": "difference between rising and falling severity, cm per joint",
    "acceleration_share": "largest acceleration, divided by the healthy walk's",
    "clip_acceleration_share": "largest acceleration, divided by the captured clips'",
}


def section(compared: Compared) -> PageSection:
    """A table of means. It is empty if no configuration has a character that can be hurt.

    compared: the content of compare.json.
    """
    table = injury_table(compared)
    introduction = Paragraph(INTRODUCTION) if table else None
    parts = [SectionPart(0, introduction), SectionPart(10, table, open=True, short=True)]
    return PageSection("injury", parts, title="Injury response", order=20)


def injury_table(compared: Compared) -> Table | None:
    """A row for each measure, and a column for each gait of each configuration with injuries.

    None if no configuration has injuries. compared: the content of compare.json.
    """
    # One item for each column of numbers: configuration, gait, and the summary from injury.json.
    summaries = [
        (entry["configuration"], gait, summary)
        for entry in compared["injury"]
        if entry.get("applies")
        for gait, summary in (entry.get("summary") or {}).items()
    ]
    if not summaries:
        return None
    found = {key for *_, summary in summaries for key in summary}
    keys = [*(key for key in ROW_LABELS if key in found), *sorted(found - set(ROW_LABELS))]
    columns = [Column("measure"), *(Column.number(f"{name}, {gait}") for name, gait, _ in summaries)]
    rows: list[list[Any]] = [
        [ROW_LABELS.get(key, key.replace("_", " ")), *(summary.get(key) for *_, summary in summaries)]
        for key in keys
    ]
    # The measurement `recognition` gives one share for each configuration. It is from walks, not from jogs.
    recognised = {
        e["configuration"]: e["generated"]["right"] for e in compared["recognition"] if e.get("applies")
    }
    if recognised:
        row = [
            "share of walks of 1 s in which a classifier recognises what hurts",
            *(recognised.get(name) if gait == "walk" else None for name, gait, _ in summaries),
        ]
        rows.append(row)
    return Table("compare-injury", columns, rows, "Means over the links that were hurt in training")
