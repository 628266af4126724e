"""Whether a recogniser that learns from captured clips names what generated walks were asked for.

It names hurt links, and moods and diagnoses, which are called manners: ways of walking that hold for a whole
clip. A channel is a group of inputs of the network, such as moods, with a column for each mood. The
measurement covers severities, and all channels whose columns are manners (`Channel.manner`). `found` is the
content of recognition.json.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from hobble.core.files import Json
from hobble.measures.compare import ComparisonAddition, ConfigurationResults, published_row
from hobble.measures.measure import Cost, Measure, Row, SampleOptions, sample_sentence
from hobble.measures.shown import grouped, with_spoken_names
from hobble.report import parts
from hobble.runtime import Runtime

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial

MEASURE = Measure(
    name="recognition",
    module=__name__,
    inputs=("weights", "clips", "summaries", "published"),
    options=SampleOptions,
    runtime=tuple(Runtime.model_fields),
    people=True,
    cost=Cost(memory_mb=200, mb_per_1000_frames=36, seconds_per_1000_frames=0.6, least_minutes=30),
)
# The bars of each manner: key of an effect -> label, colour. Walks are generated with the values 1 and .5.
BARS = {
    "captured": ("captured", "@muted"),
    "generated": ("generated at 1", "@accent"),
    "generated_at_half": ("generated at .5", "@predicted"),
}


def section(found: Json, material: ReportMaterial) -> parts.PageSection:
    """What hurts and what was recognised; for each channel of manners, how often its manners are recognised,
    and how much they change the walk.

    Empty for a network without injuries and manners.
    """
    channels = with_spoken_names(found.get("channels", ()), material.network["skeleton"])
    contents: list[parts.Content | None] = [recognition_chart(found)]
    for result in channels:
        effects = grouped(result["effects"], "effect")
        contents += [
            parts.Paragraph(summarise_channel(result) + sample_sentence(found)),
            *(effect_chart(result["channel"], *each) for each in effects.items()),
        ]
    content = [parts.SectionPart(i, each) for i, each in enumerate(contents)]
    return parts.PageSection("recognition", content, title="Recognition", order=21)


def recognition_chart(found: Json) -> parts.Chart | None:
    """A chart of one confusion table of hurt links, chosen in a menu. None if nothing was measured.

    In a confusion table, a row is what hurts, a column is what was recognised, and a cell is how often.
    """
    if not found.get("applies"):
        return None
    tables = {
        "generated walks": found["generated"],
        "captured clips, cross-validated": found["captured"]["cross_validated"],
        "captured clips held out of training": found["captured"]["held_out"],
    }
    return parts.chart(
        "recognition",
        layout={
            "xaxis": {"type": "category", "tickangle": -50, "automargin": True},
            "yaxis": {"type": "category", "autorange": "reversed", "automargin": True},
        },
        height=max(300, 190 + 20 * len(found["classes"])),
        choose="Walks",
        options={
            f"{label}: {_percent(table['right'])} right, {_percent(table['right_without_side'])} "
            "if the side does not count": [_confusion(table["confusion"])]
            for label, table in tables.items()
            if table["confusion"]
        },
        chance=f"{100 * found['chance']:.0f}",
        people=f"{100 * found['people']:.0f}",
        sample=sample_sentence(found),
    )


def _confusion(confusion: Json) -> parts.Trace:
    """The chart's trace of a confusion table."""
    answers = list(dict.fromkeys(answer for row in confusion.values() for answer in row))
    counts = [[row.get(answer, 0) for answer in answers] for row in confusion.values()]
    shares = [[n / max(1, sum(row)) or None for n in row] for row in counts]
    hover = "%{y} hurts, %{x} recognised: %{customdata} (%{z:.0%})<extra></extra>"
    return parts.heatmap(answers, list(confusion), shares, hover, customdata=counts, zmax=1)


def summarise_channel(result: Json) -> str:
    """A paragraph: how often the recogniser is right on generated walks, and on walks of people left out."""
    captured = result["captured"]
    alone = [manner for manner, count in captured["people_of"].items() if count < 2]
    return parts.words(
        *("manners.summary", *(["manners.alone"] if alone else [])),
        title=result["title"].lower(),
        right=_percent(result["right_at_1"]),
        captured=_percent(captured["right"]),
        people=captured["people"],
        speed=result["speed_asked"],
        alone=", ".join(alone),
    )


def effect_chart(channel: str, effect: str, rows: parts.Records) -> parts.Chart:
    """How much each manner changes a quantity, in captured and in generated walks."""
    manners, hover = [row["manner"] for row in rows], "%{x}: %{y:.2f}<extra>%{fullData.name}</extra>"
    traces = [
        parts.bar_trace(label, manners, [row[key] for row in rows], colour, hover)
        for key, (label, colour) in BARS.items()
    ]
    unit = parts.told("manners-effect.units")[effect]
    values = {"entry": "manners-effect", "effect": effect, "title": effect.capitalize(), "unit": unit}
    return parts.chart(f"{channel}-{effect}", traces, {"yaxis": {"title": unit}}, 260, **values)


def _percent(share: float | None) -> str:
    return f"{100 * (share or 0):.0f}\N{NO-BREAK SPACE}%"


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """The result of each configuration, and the share of hurt parts that is recognised, next to people's."""
    people, rows = published["recognition"], []
    found = {m.name: m.results_of("recognition") for m in all_measured}
    for name, generated in ((name, one["generated"]) for name, one in found.items() if one["applies"]):
        shares: dict[str, Any] = {
            "all severities": generated["right"],
            "all severities, left and right not distinguished": generated["right_without_side"],
        }
        hurt = [row for row in generated["by_severity"] if row["severity"] > 0]
        shares |= {f"severity {row['severity']:g}": row["right"] for row in hurt}
        for which, ours in shares.items():
            measure = f"hurt part recognised, {which} (published: by people)"
            source = {**people, "configuration": name}
            rows.append(published_row(measure, source, people["share"], ours))
    entries = [{**one, "configuration": name} for name, one in found.items()]
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
