"""Tables of configurations side by side, from compare.json."""

from __future__ import annotations

from typing import Any

from hobble.report.compare_sections import Compared
from hobble.report.formats import duration, number, size
from hobble.report.tables import Column, Table

# What the measures of the published figures are, where their names alone do not tell.
MEASURES = {
    "patches": "patches: pieces of ground cut from height maps (ours: all that the terrain stage writes)",
    "database": "database, on disk",
    "weights of 50 phases": "weights of 50 phases, as the original stores them",
}
# Measures of the injury summary in words.
INJURY = {
    "from_healthy_cm": "pose from healthy at severity 10, cm a joint",
    "speed_share": "share of the healthy speed at severity 10",
    "spearman_from_healthy": "ρ of pose and severity",
    "spearman_speed": "ρ of speed and severity",
    "spearman_back_from_healthy": "ρ of pose and severity, healing",
    "settle_seconds": "settles in, s",
    "heal_seconds": "heals in, s",
    "after_healing_cm": "left after healing, cm a joint",
    "way_back_cm": "way back from way there, cm a joint",
    "acceleration_share": "largest acceleration, of the healthy walk's",
    "clip_acceleration_share": "largest acceleration, of the captured clips'",
}


def configuration_table(compared: Compared) -> Table:
    """What sets each configuration apart, with its main figures."""
    accuracy = {entry["configuration"]: entry for entry in compared["accuracy"]}
    frames = {
        entry["configuration"]: entry["milliseconds"]["spread"]["median"]
        for entry in sorted(compared["responsivity"], key=lambda entry: entry["mode"] == "cubic")
    }
    columns = [
        Column("configuration"),
        Column("held-out error", _percent, "n"),
        Column("training error", _percent, "n"),
        Column.number("ms a frame, median"),
        Column.count("parameters"),
        Column("severities"),
        Column("data set"),
        Column.count("joints"),
        Column.count("layers"),
        Column.count("units"),
        Column.count("passes"),
        Column("weights", lambda v: size(float(v)), "n"),
    ]
    rows = [
        [
            entry["configuration"],
            accuracy[entry["configuration"]]["held_out"]["mean"],
            accuracy[entry["configuration"]]["train"]["mean"],
            frames.get(entry["configuration"]),
            entry["computations"]["true"],
            "inputs" if entry["injury"] else "none",
            entry["dataset"],
            entry["joints"],
            entry["hidden_layers"],
            entry["units"],
            entry["passes"],
            entry["weights_bytes"]["cubic"],
        ]
        for entry in compared["configurations"]
    ]
    return Table("compare-configurations", columns, rows, "The configurations")


def difference_table(compared: Compared) -> Table | None:
    """Every pair and what it is over, errors and frame times."""
    keys = ("mean_a", "sd_a", "mean_b", "sd_b", "difference")
    found = [("error", r) for r in compared["difference"]]
    found += [("mean ms a frame", r) for r in compared["milliseconds"]["difference"]]
    rows = [
        [r["a"], r["b"], f"{what}, {r['over'].replace('_', ' ')}", *(r[key] for key in keys)]
        for what, r in found
    ]
    if not rows:
        return None
    columns = [Column("one"), Column("other"), Column("of")]
    columns += [
        Column.number(label) for label in ("mean, one", "sd, one", "mean, other", "sd, other", "eq. 3.2")
    ]
    return Table("compare-difference", columns, rows, "Every pair")


def beside_table(compared: Compared) -> Table:
    """The published figures with ours."""
    sources = compared["published"]["sources"]
    shows = {"bytes": size, "s": duration}
    rows = []
    found = (*compared["beside"], *compared["milliseconds"]["beside"])
    for row in sorted(found, key=lambda row: row["ours"] is None):
        show = shows.get(row["unit"], lambda value: number(value, 3))
        unit = f" {row['unit']}" if row["unit"] and row["unit"] not in shows else ""
        texts = ["" if row[k] is None else f"{show(float(row[k]))}{unit}" for k in ("published", "ours")]
        measure = MEASURES.get(row["measure"], row["measure"])
        measure += ", mean" if row["unit"] == "ms" else ""
        rows.append([measure, row["configuration"], *texts, sources.get(row["source"], row["source"])])
    columns = [
        Column("measure"),
        Column("configuration"),
        Column("published"),
        Column("ours"),
        Column("source"),
    ]
    return Table("compare-published", columns, rows, "Beside the published figures")


def injury_table(compared: Compared) -> Table | None:
    """What severities do, on average, in the configurations that know them."""
    rows = [
        (entry["configuration"], gait, summary)
        for entry in compared["injury"]
        if entry.get("applies")
        for gait, summary in (entry.get("summary") or {}).items()
    ]
    if not rows:
        return None
    found = {key for *_, summary in rows for key in summary}
    keys = [*(key for key in INJURY if key in found), *sorted(found - set(INJURY))]
    columns = [Column("measure"), *(Column.number(f"{name}, {gait}") for name, gait, _ in rows)]
    table: list[list[Any]] = [
        [INJURY.get(key, key.replace("_", " ")), *(summary.get(key) for *_, summary in rows)] for key in keys
    ]
    right = {e["configuration"]: e["generated"]["right"] for e in compared["recognition"] if e.get("applies")}
    if right:
        row = ["share of hurt parts that a classifier names right", *(right.get(name) for name, *_ in rows)]
        table.append(row)
    return Table("compare-injury", columns, table, "Means over the links that were hurt in training")


def _percent(value: Any) -> str:
    return f"{100 * float(value):.2f} %"
