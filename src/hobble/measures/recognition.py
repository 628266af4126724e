"""Whether a classifier that learns from captured clips recognises hurt parts in generated walks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from hobble.core.files import Json
from hobble.measures.compare import ComparisonAddition, ConfigurationResults, published_row
from hobble.measures.measure import Cost, Measure, Row, SampleOptions, sample_sentence
from hobble.report import parts
from hobble.runtime.options import Runtime

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial

MEASURE = Measure(
    name="recognition",
    module=__name__,
    inputs=("weights", "clips", "summaries", "published"),
    options=SampleOptions,
    runtime=tuple(Runtime.model_fields),
    channel="injury",
    cost=Cost(mb_per_1000_frames=18, seconds_per_1000_frames=0.2, least_minutes=30),
)
# Layout of a chart of which both axes name classes or links.
NAMED_AXES = {
    "xaxis": {"type": "category", "tickangle": -50, "automargin": True},
    "yaxis": {"type": "category", "autorange": "reversed", "automargin": True},
}


def section(found: Json, material: ReportMaterial) -> parts.PageSection:
    """The part of the section on injuries that shows recognition.json, which is `found`."""
    return parts.PageSection("injury", [parts.SectionPart(30, recognition_chart(found))])


def recognition_chart(found: Json) -> parts.Chart | None:
    """A chart of one confusion table of the classifier, chosen in a menu. None if nothing was measured.

    found: the content of recognition.json. In a confusion table, a row is what hurts, a column is what was
    recognised, and a cell is how often.
    """
    if not found.get("applies"):
        return None
    generated, captured = found["generated"], found["captured"]
    tables = {
        "generated walks, whole": generated["by_walk"],
        "generated walks, by window": generated,
        "captured clips, cross-validated": captured["cross_validated"],
        "captured clips held out of training": captured["held_out"],
    }
    return parts.chart(
        "recognition",
        layout=NAMED_AXES,
        height=max(300, 190 + 20 * len(found["classes"])),
        choose="Walks",
        options={
            _title(label, shown): [_confusion(shown)]
            for label, shown in tables.items()
            if shown.get("confusion")
        },
        chance=f"{100 * found['chance']:.0f}",
        people=f"{100 * found['people']:.0f}",
        sample=sample_sentence(found),
    )


def _title(label: str, table: Json) -> str:
    """An option of the menu: what was judged, and how often the answer is right."""
    if table.get("right") is not None:
        label += f": {100 * table['right']:.0f} % right"
    if table.get("right_without_side") is not None:
        label += f", {100 * table['right_without_side']:.0f} % if the side does not count"
    return label


def _confusion(table: Json) -> Any:
    """The chart's trace of a confusion table."""
    confusion = table["confusion"]
    answers = list(dict.fromkeys(answer for row in confusion.values() for answer in row))
    counts = [[row.get(answer, 0) for answer in answers] for row in confusion.values()]
    totals = [max(1, sum(row.values())) for row in confusion.values()]
    shares = [[n / total or None for n in row] for row, total in zip(counts, totals, strict=True)]
    hover = "%{y} hurts, %{x} recognised: %{customdata} (%{z:.0%})<extra></extra>"
    return parts.heatmap(answers, list(confusion), shares, hover, customdata=counts, zmax=1)


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """The result of each configuration, and the share of hurt parts that is recognised, next to people's."""
    people = published["recognition"]
    rows = []
    for results in all_measured:
        if not (found := results.results_of("recognition"))["applies"]:
            continue
        generated = found["generated"]
        shares = {
            "all severities": generated["right"],
            "all severities, left and right not distinguished": generated["right_without_side"],
        }
        hurt = [row for row in generated["by_severity"] if row["severity"] > 0]
        shares |= {f"severity {row['severity']:g}": row["right"] for row in hurt}
        source = {**people, "configuration": results.name}
        for which, ours in shares.items():
            measure = f"hurt part recognised, {which} (published: by people)"
            rows.append(published_row(measure, source, people["share"], ours))
    entries = [{**m.results_of("recognition"), "configuration": m.name} for m in all_measured]
    return ComparisonAddition(entries=entries, against_published=rows)


def tables(compared: Json) -> dict[str, list[Row]]:
    """The confusion tables of all configurations, as one table. compared: the content of compare.json."""
    from hobble.measures.recognition_run import confusion_rows

    return {
        "recognition": [
            {"configuration": entry["configuration"], **row}
            for entry in compared["recognition"]
            for row in confusion_rows(entry)
        ]
    }
