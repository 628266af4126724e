"""Shows in the report how well the next pose is predicted, clip by clip.

In all functions, `found` is the content of accuracy.json, or {} if accuracy was not measured.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from hobble.measures.clip_parts import sample_in_words
from hobble.measures.inputs import Json
from hobble.report.gather import ReportMaterial
from hobble.report.parts import (
    Chart,
    Column,
    Hint,
    KeyFigure,
    PageSection,
    Paragraph,
    SectionPart,
    Table,
    TemplatePart,
    axis,
    citation,
    format_duration,
    format_number,
    reference_line,
    with_order,
)

INTRODUCTION = (
    "The network gets its input from a frame of a clip and predicts the next frame. The error is measured on "
    "every frame that belongs to a gait cycle. Captured motion means the motion of the clip, also if it was "
    "generated."
)
# Ending of a clip's name -> a sentence that explains it. Otherwise readers may take the number in _hurt1 for
# a severity. Another ending may follow, as in walk_hurt1_mirror.
ENDINGS = {
    "_hurt1": " A clip whose name ends in _hurt1 is the first hurt version of a healthy clip; the number is "
    "not its severity.",
    "_mirror": " A clip whose name ends in _mirror is mirrored.",
}
COLOURS = {"train": "@muted", "held_out": "@accent"}  # split -> its colour in the charts
NAMES = {"train": "training", "held_out": "held out"}  # split -> its name on the page
# The keys of the 5th to 95th percentile of the error in accuracy.json.
QUANTILES = ("p05", "p25", "p50", "p75", "p95")


def _rows(found: Json) -> list[dict[str, Any]]:
    """The entries of the clips that were measured: held-out clips first, each split by rising error."""
    rows = [row for row in found.get("clips", ()) if row.get("mean") is not None]
    return sorted(rows, key=lambda row: (row["split"] != "held_out", row["mean"]))


def _height(count: int) -> int:
    """The height in pixels of a chart with a row for each of `count` clips."""
    return max(260, 110 + 21 * count)


def clip_bars(found: Json, material: ReportMaterial) -> Chart | None:
    """A bar with the mean relative error of each clip, and a line at the published mean.

    A whisker on each bar shows the standard deviation. None if no clip was measured.
    """
    rows = _rows(found)[::-1]  # plotly puts the first clip at the bottom
    if not rows:
        return None
    traces = []
    for split in ("held_out", "train"):
        chosen = [row for row in rows if row["split"] == split]
        traces.append(
            {
                "type": "bar",
                "orientation": "h",
                "name": NAMES[split],
                "y": [row["clip"] for row in chosen],
                "x": [100 * row["mean"] for row in chosen],
                "error_x": {
                    "type": "data",
                    "symmetric": False,
                    "array": [100 * (row.get("sd") or 0) for row in chosen],
                    "arrayminus": [0 for _ in chosen],
                    "color": "@faint",
                    "thickness": 1,
                    "width": 2,
                },
                "marker": {"color": COLOURS[split]},
                "hovertemplate": "%{y}: %{x:.2f} %<extra></extra>",
            }
        )
    shapes, notes = [], []
    published = material.published_entry("accuracy")
    if published:
        shape, note = reference_line(100 * published["mean"], f"{published['label']}, published")
        shapes, notes = [shape], [note]
    order = [row["clip"] for row in rows]
    return Chart(
        "accuracy-clips",
        "Error of each clip",
        "The error of a joint is the distance between its predicted and its captured position, divided by "
        "its distance from the root (eq. 3.1 of Segerstedt). Bars are means over frames and joints. Whiskers "
        "are one standard deviation long."
        + (
            " Held-out clips come first: the network was not trained on them."
            if any(row["split"] == "held_out" for row in rows)
            else ""
        ),
        traces,
        {
            "xaxis": axis("relative error, %", rangemode="tozero"),
            "yaxis": {"categoryorder": "array", "categoryarray": order, "automargin": True},
            "shapes": shapes,
            "annotations": notes,
            "bargap": 0.35,
            "barmode": "overlay",
        },
        height=_height(len(rows)),
    )


def clip_boxes(found: Json) -> Chart | None:
    """A box for each clip: quantiles of its error over frames and joints. None if no clip has quantiles."""
    rows = [row for row in _rows(found)[::-1] if quantiles(row)]  # plotly puts the first clip at the bottom
    if not rows:
        return None
    traces = []
    for split in ("held_out", "train"):
        chosen = [row for row in rows if row["split"] == split]
        if not chosen:
            continue
        values = [[100 * v for v in quantiles(row)] for row in chosen]  # type: ignore[union-attr]
        low, q1, median, q3, high = (list(column) for column in zip(*values, strict=True))
        traces.append(
            {
                "type": "box",
                "orientation": "h",
                "name": NAMES[split],
                "y": [row["clip"] for row in chosen],
                "lowerfence": low,
                "q1": q1,
                "median": median,
                "q3": q3,
                "upperfence": high,
                "mean": [100 * row["mean"] for row in chosen],
                "marker": {"color": COLOURS[split]},
                "line": {"width": 1.4, "color": COLOURS[split] if split == "held_out" else "@faint"},
                "fillcolor": "@accent-wash" if split == "held_out" else "@sunken",
            }
        )
    return Chart(
        "accuracy-boxes",
        "Spread within each clip",
        "Each box holds the middle half of the errors of a clip. The solid line in it is the median, "
        "the dotted line the mean. Whiskers reach from the 5th to the 95th percentile. A box near zero with "
        "a long whisker means that the clip is easy except for a few moments.",
        traces,
        {
            "xaxis": axis("relative error, %", rangemode="tozero"),
            "yaxis": {
                "categoryorder": "array",
                "categoryarray": [r["clip"] for r in rows],
                "automargin": True,
            },
            "boxmode": "overlay",
        },
        height=_height(len(rows)),
    )


def quantiles(row: dict[str, Any]) -> list[float] | None:
    """The 5th, 25th, 50th, 75th and 95th percentile of the relative error; None if one is missing.

    row: the errors of a clip or a split, as in accuracy.json.
    """
    values = [row[key] for key in QUANTILES if row.get(key) is not None]
    return values if len(values) == len(QUANTILES) else None


def accuracy_table(found: Json, name: str) -> Table:
    """A row for each clip that was measured: its number of frames and its errors. name: the configuration."""
    columns = [
        Column("clip"),
        Column("split", lambda value: NAMES.get(value, value)),
        Column.count("frames"),
        Column.number("mean"),
        Column.number("sd"),
        Column.number("position error, cm"),
    ]
    rows = [
        [r["clip"], r["split"], r.get("frames"), r["mean"], r.get("sd"), r.get("position_error_cm")]
        for r in _rows(found)
    ]
    return Table(f"{name}-accuracy", columns, rows)


def published_table(found: Json, material: ReportMaterial) -> Table:
    """The errors of our network on both splits, followed by the published means."""
    rows: list[list[Any]] = []
    for split in ("held_out", "train"):
        part = found.get(split) or {}
        if part.get("mean") is not None:
            what = f"{material.name}, {NAMES[split]} clips"
            rows.append([what, part["mean"], part.get("sd"), part.get("position_error_cm"), "this report"])
    sources = material.published["sources"]
    for entry in material.published["accuracy"]:
        rows.append([entry["label"], entry["mean"], None, None, citation(entry, sources)])
    columns = [
        Column("network"),
        Column.number("mean error, as a fraction"),
        Column.number("sd"),
        Column.number("position error, cm"),
        Column("source", kind="long"),
    ]
    return Table(f"{material.name}-published", columns, rows, "Comparison with published results")


def section(found: Json, material: ReportMaterial) -> PageSection:
    """Charts, tables, and a view of captured and predicted motion. Empty without measured clips."""
    if not found.get("clips"):
        return PageSection("accuracy", [])
    # The first argument of each part is its place in the section, from 0 (top) to 100 (end).
    return PageSection(
        "accuracy",
        [
            SectionPart(0, Paragraph(INTRODUCTION + explain_endings(found) + describe_sample(found))),
            SectionPart(9, Paragraph(caveat(found, material))),
            SectionPart(10, published_table(found, material), open=True, short=True),
            SectionPart(20, clip_bars(found, material), tall=True),
            SectionPart(30, clip_boxes(found), tall=True),
            SectionPart(60, accuracy_table(found, material.name)),
            SectionPart(90, TemplatePart("captured.html.j2")),
        ],
        title="Accuracy",
        order=10,
        long=True,
    )


def explain_endings(found: Json) -> str:
    """A sentence for each of the ENDINGS that a measured clip has; empty if there is none."""
    clips = [row["clip"] for row in _rows(found)]
    return "".join(text for ending, text in ENDINGS.items() if any(ending in clip for clip in clips))


def caveat(found: Json, material: ReportMaterial) -> str:
    """A paragraph: why these errors must not be compared with the published ones."""
    # The number of measured frames, at 60 a second. Only gait cycles are measured, so the clips are longer.
    frames = sum((found.get(split) or {}).get("frames") or 0 for split in ("held_out", "train"))
    return (
        "Do not compare these errors with the published ones as if the clips were the same. Ours are "
        f"measured on {format_duration(frames / 60)} of gait cycles in the data set {material.dataset}, the "
        "published ones on 80 clips of Holden et al. (2017). A small error may only mean that the clips are "
        "easy to predict."
    )


def describe_sample(found: Json) -> str:
    """Which part of the clips was measured, with confidence intervals; empty if all clips were measured."""
    if not found.get("sample"):
        return ""
    means = [
        f"{NAMES[split]} {100 * found[split]['mean']:.2f} ± {100 * found[split]['interval']['mean']:.2f} %"
        for split in ("held_out", "train")
        if (found.get(split) or {}).get("interval")
    ]
    return (
        f" Measured on {sample_in_words(found)}, and weighted to represent all clips. 95 % confidence "
        f"intervals of the means over all frames of all clips: {', '.join(means)}."
    )


def figures(found: Json, material: ReportMaterial) -> Iterator[KeyFigure]:
    """The key figures: the error on each split that was measured."""
    for at, split, label in (
        (10, "held_out", "Error on held-out clips"),
        (11, "train", "Error on training clips"),
    ):
        part = found.get(split)
        if part and part.get("mean") is not None:
            error = part.get("position_error_cm")
            note = "of a joint's distance from the root"
            note += f"; {_centimetres(error, split, material)}" if error is not None else ""
            published = material.published_entry("accuracy") if split == "held_out" else None
            if published:
                mean = 100 * published["mean"]
                note += f"; published for {published['label']}: {mean:.2f} %, on other clips"
            yield KeyFigure(label, f"{100 * part['mean']:.2f}", "%", note, at)


def _centimetres(error: float, split: str, material: ReportMaterial) -> str:
    """The mean position error in words: of the predicted joints, and of the joints as the runtime draws them.

    The runtime draws a joint halfway between its predicted position and its old position plus the predicted
    velocity. This error is left out if the measurement `rollouts` has no roll-outs of one frame.

    error: the error of the predicted joints, cm.
    """
    lengths = {entry["length"]: entry for entry in material.results_of("rollouts").get("lengths", ())}
    drawn = (lengths.get(1, {}).get(split) or {}).get("position_error_cm")
    if drawn is None:
        return f"{format_number(error)} cm per joint on average"
    drawn_text = f"{format_number(drawn)} cm as drawn (explained under Accuracy)"
    return f"{format_number(error)} cm per joint as predicted; {drawn_text}"


def hints(found: Json, material: ReportMaterial) -> Iterator[Hint]:
    """How well the network generalises, and which clip has the largest error."""
    # Places of hints (`Hint.order`): under 20 for advice on the data, 30 for advice on the network.
    held_out = (found.get("held_out") or {}).get("mean")
    yield from with_order(10 if held_out is None else 30, _generalisation(found))
    yield from with_order(12, _worst_clip(found))


def _generalisation(found: Json) -> Iterator[Hint]:
    """A hint that compares the errors on held-out and training clips."""
    train, held_out = (found.get(split) or {} for split in ("train", "held_out"))
    if held_out.get("mean") is None:
        yield Hint(
            "warn",
            "No clips were held out.",
            "So the errors on this page do not show how well the network predicts new clips. List a few "
            "clips under held_out in the data set.",
        )
        return
    if not train.get("mean"):
        return
    ratio = held_out["mean"] / train["mean"]
    if ratio > 1.5:
        yield Hint(
            "warn",
            f"The error on held-out clips is {ratio:.1f} times the error on training clips.",
            "The network overfits. Add more varied clips (speeds, turns, performers) before you make the "
            "network larger or train it longer.",
        )
    elif ratio < 1.2:
        yield Hint(
            "good",
            f"The error on held-out clips is {ratio:.2f} times the error on training clips, so the network "
            "does not overfit.",
            "A larger network may do better.",
        )
    else:
        yield Hint(
            "fact",
            f"The error on held-out clips is {ratio:.2f} times the error on training clips.",
            "That is usual.",
        )


def _worst_clip(found: Json) -> Iterator[Hint]:
    """A hint on the clip with the largest error, if that is far above the median of all clips."""
    rows = [row for row in found.get("clips", ()) if row.get("mean") is not None]
    if len(rows) < 4:
        return
    median = float(np.median([row["mean"] for row in rows]))
    worst = max(rows, key=lambda row: row["mean"])
    if worst["mean"] > 1.8 * median:
        # The section Labels does not show mirrored clips.
        source = worst["clip"].removesuffix("_mirror")
        whose = "its labels" if source == worst["clip"] else f"the labels of {source}, which it mirrors,"
        yield Hint(
            "note",
            f"{worst['clip']} has the largest error,",
            f"{worst['mean'] / median:.1f} times the median over all clips. "
            f"Check {whose} in the section Labels.",
        )
