"""Shows in the report's section on injuries whether hurt parts are recognised."""

from __future__ import annotations

from hobble.core.files import Json
from hobble.measures.measure import sample_sentence
from hobble.report.gather import ReportMaterial
from hobble.report.parts import Chart, PageSection, SectionPart, Trace


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The part of the section on injuries that shows recognition.json, which is `found`."""
    return PageSection("injury", [SectionPart(30, recognition_chart(found))])


def recognition_chart(found: Json) -> Chart | None:
    """A chart of one confusion table of the classifier, chosen in a menu. None if nothing was measured.

    found: the content of recognition.json. In a confusion table, a row is what hurts, a column is what was
    recognised, and a cell is how often.
    """
    if not found.get("applies"):
        return None
    generated, captured = found["generated"], found["captured"]
    tables = {
        "generated walks, whole": generated.get("by_walk"),
        "generated walks, by window": generated,
        "captured clips, cross-validated": captured.get("cross_validated"),
        "captured clips held out of training": captured.get("held_out"),
    }
    options: dict[str, list[Trace]] = {}
    for label, table in tables.items():
        if not table or not table.get("confusion"):
            continue
        confusion = table["confusion"]
        answers = list(dict.fromkeys(answer for row in confusion.values() for answer in row))
        hurt = list(confusion)
        shares = [
            [confusion[h].get(a, 0) / max(1, sum(confusion[h].values())) for a in answers] for h in hurt
        ]
        title = label
        if table.get("right") is not None:
            title += f": {100 * table['right']:.0f} % right"
        if table.get("right_without_side") is not None:
            title += f", {100 * table['right_without_side']:.0f} % if the side does not count"
        options[title] = [
            {
                "type": "heatmap",
                "x": answers,
                "y": hurt,
                "z": [[v or None for v in row] for row in shares],
                "customdata": [[confusion[h].get(a, 0) for a in answers] for h in hurt],
                "colorscale": [[0, "@sunken"], [1, "@accent"]],
                "zmin": 0,
                "zmax": 1,
                "xgap": 2,
                "ygap": 2,
                "showscale": False,
                "hovertemplate": "%{y} hurts, %{x} recognised: %{customdata} (%{z:.0%})<extra></extra>",
            }
        ]
    if not options:
        return None
    classes = len(found.get("classes") or ())
    people = found.get("people")
    by_people = f" People recognised the part {100 * people:.0f} % of the time" if people else ""
    note = f"{by_people} (Ferre 2019, on the motion of another network)." if by_people else ""
    return Chart(
        "recognition",
        "Is the hurt part recognised?",
        "A classifier trained on captured clips says which part hurts. Rows: the part that hurts. Columns: "
        "the answer of the classifier. Answers on the diagonal are right. A random guess is right "
        f"{100 * (found.get('chance') or 0):.0f} % of the time.{note}{sample_sentence(found)}",
        layout={
            "xaxis": {"type": "category", "tickangle": -50, "automargin": True},
            "yaxis": {"type": "category", "autorange": "reversed", "automargin": True},
        },
        height=max(300, 190 + 20 * classes),
        choose="Walks",
        options=options,
    )
