"""Tables of the comparison page, from compare.json."""

from __future__ import annotations

from typing import Any

from hobble.report.comparison_charts import Compared
from hobble.report.formats import format_bytes, format_duration, format_number
from hobble.report.measure_sections import OverviewColumn, compared_columns
from hobble.report.published import citation
from hobble.report.tables import Column, Table

# Published measure -> a longer name, if its own name is unclear.
LONGER_NAMES = {
    "patches": "patches: pieces of ground cut from height maps (ours: all files of the terrain stage)",
    "database": "database, on disk",
    "weights of 50 phases": "weights of 50 phases, as the code of Holden et al. stores them",
}
# Columns of the table of pairs of configurations: (key in compare.json, heading). "one" and "other" are the
# two configurations of a pair. "sd of frames" is the standard deviation over single frames. "sd of means" is
# that of the means of clips, or, for frame times, of the means of laps on the test track.
PAIR_COLUMNS = (
    ("mean_a", "mean, one"),
    ("sd_a", "sd of frames, one"),
    ("sd_of_means_a", "sd of means, one"),
    ("mean_b", "mean, other"),
    ("sd_b", "sd of frames, other"),
    ("sd_of_means_b", "sd of means, other"),
    ("difference", "eq. 3.2, frames"),
    ("difference_of_means", "eq. 3.2, means"),
)


def configuration_table(compared: Compared) -> Table:
    """A row for each configuration: its settings and the main results of its measurements."""
    entries = {entry["configuration"]: entry for entry in compared["configurations"]}

    def by_name(key: str) -> dict[str, Any]:
        """Configuration -> its entry `key` in compare.json."""
        return {name: entry[key] for name, entry in entries.items()}

    channel_names = {name: ", ".join(channels) or "none" for name, channels in by_name("channels").items()}
    columns = [
        *compared_columns(compared),
        OverviewColumn(50, Column("channels"), channel_names),
        OverviewColumn(60, Column("data set"), by_name("dataset")),
        OverviewColumn(80, Column.count("layers"), by_name("hidden_layers")),
        OverviewColumn(90, Column.count("units"), by_name("units")),
        OverviewColumn(100, Column.number("passes"), by_name("passes")),
    ]
    columns.sort(key=lambda column: column.order)
    rows = [[name, *(column.values.get(name) for column in columns)] for name in entries]
    heads = [Column("configuration"), *(column.column for column in columns)]
    return Table("compare-configurations", heads, rows, "The configurations")


def difference_table(compared: Compared) -> Table | None:
    """Errors and frame times of each pair of configurations, and their difference; None without pairs.

    By eq. 3.2 of Segerstedt (2021), the difference of two means is divided by the mean of their standard
    deviations. One column has the result for deviations over single frames, another for those over means of
    clips or laps.
    """
    pairs = [("error", r) for r in compared["difference"]]
    pairs += [("mean ms a frame", r) for r in compared["milliseconds"].get("difference", ())]
    rows = [
        [r["a"], r["b"], f"{what}, {r['over'].replace('_', ' ')}", *(r.get(key) for key, _ in PAIR_COLUMNS)]
        for what, r in pairs
    ]
    if not rows:
        return None
    columns = [Column("one"), Column("other"), Column("measured")]
    columns += [Column.number(label) for _, label in PAIR_COLUMNS]
    return Table("compare-difference", columns, rows, "Differences between all pairs")


def published_table(compared: Compared) -> Table:
    """The published results next to ours. Results that we did not measure come last."""
    sources = compared["published"]["sources"]
    formats = {"bytes": format_bytes, "s": format_duration}
    rows = []
    published = (*compared["against_published"], *compared["milliseconds"]["against_published"])
    for row in sorted(published, key=lambda row: row["ours"] is None):
        as_text = formats.get(row["unit"], lambda value: format_number(value, 3))
        unit = f" {row['unit']}" if row["unit"] and row["unit"] not in formats else ""
        texts = [
            "" if row[key] is None else f"{as_text(float(row[key]))}{unit}" for key in ("published", "ours")
        ]
        measure = LONGER_NAMES.get(row["measure"], row["measure"])
        measure += ", mean" if row["unit"] == "ms" and not measure.startswith("standard") else ""
        rows.append([measure, row["configuration"], *texts, citation(row, sources)])
    columns = [
        Column("measure"),
        Column("configuration"),
        Column("published"),
        Column("ours"),
        Column("source"),
    ]
    return Table("compare-published", columns, rows, "Comparison with published results")
