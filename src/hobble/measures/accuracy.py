"""How well the network predicts the next frame, on training and held-out clips.

The relative error of a joint (eq. 3.1 of Segerstedt 2021) is the distance between its predicted and its
captured position, divided by its distance from the root. JSON files have it as a fraction, pages show it in
%. `found` is the content of accuracy.json, or {} if accuracy was not measured.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.core.files import Json
from hobble.measures import compare, measure
from hobble.measures.measure import SPLITS, Row
from hobble.measures.shown import boxes, ours_and_published
from hobble.report import parts
from hobble.report.parts import SPLITS as SPLIT_LABELS
from hobble.report.parts import Chart, Compared, Hint, PageSection, SectionPart, Trace

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial


class Options(measure.JointOptions, measure.SampleOptions):
    """The keys of this measurement in a configuration's section `evaluation`."""


MEASURE = measure.Measure(
    name="accuracy",
    module=__name__,
    inputs=("weights", "clips", "summaries", "skeleton"),
    options=Options,
    # For each thousand frames: 12 MB and 0.2 s. At least 10 minutes.
    cost=measure.Cost(mb_per_1000_frames=12, seconds_per_1000_frames=0.2, least_minutes=10),
)
COLOURS = {"train": "@muted", "held_out": "@accent"}  # split -> its colour in the charts
NAMES = {"held_out": "held out", "train": "training"}  # split -> its name on the page
# Edges of a box, as plotly names them -> keys of accuracy.json.
BOX = {"lowerfence": "p05", "q1": "p25", "median": "p50", "q3": "p75", "upperfence": "p95", "mean": "mean"}
CLIP_HEADS = {
    key: parts.in_words(key) for key in ("clip", "split", "frames", "mean", "sd", "position_error_cm")
}
ERROR_AXIS = parts.axis("relative error, %", rangemode="tozero")
# Key of a difference between two configurations in compare.json -> what it is divided by (eq. 3.2).
DEVIATIONS = {"difference_of_means": "sd of the means of clips", "difference": "sd of single frames"}


def section(found: Json, material: ReportMaterial) -> PageSection:
    """Charts, tables, and a view of captured and predicted motion. Empty without measured clips."""
    if not found.get("clips"):
        return PageSection("accuracy", [])
    # Readers may take the number in _hurt1 for a severity, so endings of names are explained.
    endings = [end for end in ("_hurt1", "_mirror") if any(end in row["clip"] for row in found["clips"])]
    introduction = parts.words("accuracy.introduction", *(f"accuracy.{end[1:]}" for end in endings))
    of_clips = parts.table(
        f"{material.name}-accuracy", _measured(found), CLIP_HEADS, show={"split": NAMES.__getitem__}
    )
    # Only gait cycles are measured, so the clips are longer.
    seconds = sum(found[split]["frames"] for split in NAMES) / 60
    duration = parts.format_duration(seconds)
    shown = [
        SectionPart(0, parts.Paragraph(introduction + _about_sample(found))),
        SectionPart(
            9, parts.Paragraph(parts.words("accuracy.caveat", duration=duration, dataset=material.dataset))
        ),
        SectionPart(10, published_table(found, material), open=True),
        SectionPart(30, clip_boxes(found, material)),
        SectionPart(60, of_clips),
        SectionPart(90, parts.TemplatePart("captured.html.j2")),
    ]
    return PageSection("accuracy", shown, title="Accuracy", order=10, long=True)


def _measured(found: Json) -> list[dict[str, Any]]:
    """The entries of the clips that were measured: held-out clips first, each split by rising error."""
    rows = [row for row in found.get("clips", ()) if row["mean"] is not None]
    return sorted(rows, key=lambda row: (row["split"] != "held_out", row["mean"]))


def _about_sample(found: Json) -> str:
    """Which part of the clips was measured, with confidence intervals; empty if all clips were measured."""
    if not found.get("sample"):
        return ""
    means = [
        f"{NAMES[split]} {100 * found[split]['mean']:.2f} ± {100 * found[split]['interval']['mean']:.2f} %"
        for split in NAMES
        if found[split].get("interval")
    ]
    sample = measure.sample_in_words(found)
    return " " + parts.words("accuracy.sample", sample=sample, means=", ".join(means))


def clip_boxes(found: Json, material: ReportMaterial) -> Chart:
    """A box for each clip: quantiles of its error over frames and joints. Published means are diamonds.

    Held-out clips come first, then the others by their mean error. A line is at the published mean of all
    clips.
    """
    rows = _measured(found)[::-1]  # plotly puts the first at the bottom
    traces = []
    for split, fill, line in (("held_out", "@accent-wash", "@accent"), ("train", "@sunken", "@faint")):
        if chosen := [row for row in rows if row["split"] == split]:
            place = {"orientation": "h", "y": [row["clip"] for row in chosen], "fillcolor": fill}
            traces.append(quantile_boxes(NAMES[split], chosen, COLOURS[split], line, **place))
    means = material.published["clip_means"].get(material.name, ())
    theirs = dict(zip(compare.published_clips(material.published), means, strict=False))
    if shown := [row["clip"] for row in rows if row["clip"] in theirs]:
        diamond = {"symbol": "diamond-open", "size": 7, "color": "@ink"}
        x = [100 * theirs[clip] for clip in shown]
        traces.append(parts.marker_trace("published mean", x, shown, diamond))
    published = material.published_entry("accuracy")
    mean = (
        parts.reference_line(100 * published["mean"], f"{published['label']}, published") if published else {}
    )
    clips = parts.ordered_axis(row["clip"] for row in rows)
    layout = {"xaxis": ERROR_AXIS, "yaxis": clips, "boxmode": "overlay", **mean}
    more = ["held_out"] if any(row["split"] == "held_out" for row in rows) else []
    return parts.chart("accuracy-boxes", traces, layout, max(260, 110 + 21 * len(rows)), more=more)


def quantile_boxes(name: str, errors: Sequence[Json], colour: str, line: str, **more: Any) -> Trace:
    """Boxes of the relative error in %, one for each entry of accuracy.json in `errors`."""
    values = {edge: [100 * entry[key] for entry in errors] for edge, key in BOX.items()}
    return boxes(name, line, **values, marker={"color": colour}, **more)


def published_table(found: Json, material: ReportMaterial) -> parts.Table:
    """Means and standard deviations of the clips' mean errors: ours on both splits, then the published ones.

    Ours are measured as the published ones were, see `measure_accuracy` in `hobble.measures.accuracy_run`.
    """
    ours = [
        {
            "network": f"{material.name}, {name} clips",
            "mean": found[split]["as_published"]["mean_of_clips"],
            "sd": found[split]["as_published"]["sd_of_clips"],
            "cm": found[split]["position_error_cm"],
            "source": "this report",
        }
        for split, name in NAMES.items()
        if found[split].get("as_published")
    ]
    heads = {
        "network": "network",
        "mean": "mean error of the clips, as a fraction",
        "sd": "sd of these means",
        "cm": "position error, cm (all frames, exact phase)",
        "source": "source",
    }
    rows = [*ours, *material.published_records("accuracy")]
    return parts.table(f"{material.name}-published", rows, heads, parts.words("accuracy.published"))


def figures(found: Json, material: ReportMaterial) -> Iterator[parts.KeyFigure]:
    """The key figures: the error on each split that was measured."""
    for order, (split, label) in enumerate(SPLIT_LABELS.items(), 10):
        part = found.get(split)
        if part and part["mean"] is not None:
            note = f"of a joint's distance from the root; {_centimetres(part, split, material)}"
            if (published := material.published_entry("accuracy")) and split == "held_out":
                mean = 100 * published["mean"]
                note += f"; published for {published['label']}: {mean:.2f} %, on other clips"
            yield parts.KeyFigure(f"Error on {label}", f"{100 * part['mean']:.2f}", "%", note, order)


def _centimetres(part: Json, split: str, material: ReportMaterial) -> str:
    """The mean position error in words: of the predicted joints, and of the joints as the runtime draws them.

    The runtime draws a joint halfway between its predicted position and its old position plus the predicted
    velocity. This error is left out if the measurement `rollouts` has no roll-outs of one frame.
    """
    error = parts.format_number(part["position_error_cm"])
    lengths = {entry["length"]: entry for entry in material.results_of("rollouts").get("lengths", ())}
    drawn = lengths.get(1, {}).get(split, {}).get("position_error_cm")
    if drawn is None:
        return f"{error} cm per joint on average"
    as_drawn = parts.format_number(drawn)
    return f"{error} cm per joint as predicted; {as_drawn} cm as drawn (explained under Accuracy)"


def hints(found: Json, material: ReportMaterial) -> Iterator[Hint]:
    """How well the network generalises, and which clip has the largest error."""
    # Places of hints (`Hint.order`): under 20 for advice on the data, 30 for advice on the network.
    train, held_out = ((found.get(split) or {}).get("mean") for split in SPLITS)
    if held_out is None:
        yield Hint("warn", "No clips were held out.", parts.words("accuracy.none-held-out"), 10)
    elif train:
        ratio = held_out / train
        many = f"{ratio:.1f}" if ratio > 1.5 else f"{ratio:.2f}"
        head = f"The error on held-out clips is {many} times the error on training clips"
        if ratio > 1.5:
            yield Hint("warn", f"{head}.", parts.words("accuracy.overfits"), 30)
        elif ratio < 1.2:
            head += ", so the network does not overfit."
            yield Hint("good", head, "A larger network may do better.", 30)
        else:
            yield Hint("fact", f"{head}.", "That is usual.", 30)
    yield from _worst_clip(_measured(found))


def _worst_clip(rows: Sequence[Json]) -> Iterator[Hint]:
    """A hint on the clip with the largest error, if that is far above the median of all clips."""
    if len(rows) < 4:
        return
    median = float(np.median([row["mean"] for row in rows]))
    worst = max(rows, key=lambda row: row["mean"])
    if worst["mean"] > 1.8 * median:
        source = worst["clip"].removesuffix("_mirror")
        whose = "its labels" if source == worst["clip"] else f"the labels of {source}, which it mirrors,"
        text = parts.words("accuracy.worst", times=f"{worst['mean'] / median:.1f}", whose=whose)
        yield Hint("note", f"{worst['clip']} has the largest error,", text, 12)


def compared(
    all_measured: Sequence[compare.ConfigurationResults], published: Json
) -> compare.ComparisonAddition:
    """The errors of each configuration, the difference of each pair, and the published errors beside ours.

    all_measured: the results of each configuration. published: the content of published.yaml.

    Two configurations are compared over each split, and over each clip on which both were measured. The
    errors of the network that Holden et al. released are beside those of any network on the same clips.
    """
    found = {m.name: m.results_of("accuracy") for m in all_measured}
    series = {
        name: {split: {**of[split], "means": clip_means(of, split)} for split in SPLITS}
        | {entry["clip"]: entry for entry in of["clips"]}
        for name, of in found.items()
    }
    differences = compare.pair_differences(
        {name: {over: one for over, one in of.items() if one["frames"]} for name, of in series.items()}
    )
    beside: list[Row] = []
    for split in SPLITS:
        statistics = {name: compare.mean_and_sd(of[split]["means"]) for name, of in series.items()}
        of_means = f"standard deviation of the means of {SPLIT_LABELS[split]}"
        for at, key, what in ((0, "mean", f"relative error, {SPLIT_LABELS[split]}"), (1, "sd", of_means)):
            ours = {name: values[at] for name, values in statistics.items()}
            beside += compare.beside_ours(what, published["accuracy"], key, ours)
    on_training = [row for row in differences if row["over"] == "train"]
    beside += compare.published_differences("error", on_training, published)
    for name, (clip, theirs) in product(found, published["released_clips"].items()):
        if mine := series[name].get(clip):
            row = {"configuration": name, "source": "release"}
            ours_mean = mine.get("as_published", mine)["mean"]
            beside.append(compare.published_row(f"relative error, {clip}", row, theirs, ours_mean))
    return compare.ComparisonAddition(
        entries=[{"dataset": m.dataset, **found[m.name], "configuration": m.name} for m in all_measured],
        about={name: {"joints": of["joints"]} for name, of in found.items()},
        differences=differences,
        against_published=beside,
    )


def tables(compared: Json) -> dict[str, list[Row]]:
    """One table: the errors of every clip in every configuration."""
    return {"accuracy": measure.flat_rows(compared["accuracy"], "clips", "configuration")}


def clip_means(found: Json, split: str) -> list[float]:
    """The mean error of each clip of a split that has one, as published ones were measured if possible."""
    clips = [c for c in found["clips"] if c["split"] == split and c["mean"] is not None]
    return [c.get("as_published", c)["mean"] for c in clips]


def compared_section(compared: Compared) -> PageSection:
    """The spread of the errors, differences between configurations, and errors of single clips."""
    charts = enumerate((error_boxes(compared), difference_map(compared), clip_lines(compared)))
    shown = [SectionPart(10 + 20 * place, each) for place, each in charts]
    return PageSection("accuracy", shown, title="Accuracy", order=10, long=True)


def compared_values(compared: Compared) -> Iterator[parts.ComparedValue]:
    """The error on each split, and the number of measured joints."""
    entries = {entry["configuration"]: entry for entry in compared["accuracy"]}
    for order, split, label in ((10, "held_out", "held-out error"), (20, "train", "training error")):
        values = {name: entry[split]["mean"] for name, entry in entries.items()}
        column = parts.Column(label, lambda value: f"{100 * value:.2f} %", "n")
        yield parts.ComparedValue(order, column, values)
    joints = {name: entry["joints"] for name, entry in entries.items()}
    yield parts.ComparedValue(70, parts.Column.count("joints"), joints)


def error_boxes(compared: Compared) -> Chart:
    """A box for each configuration: the spread of its error over all frames of a split. A menu selects it.

    With a value for each clip, boxes are of the means of clips, published ones beside ours.
    """
    colours, options = parts.configuration_colours(compared), {}
    published = {row["configuration"]: 100 * row["mean"] for row in compared["published"]["accuracy"]}
    marks = parts.marker_trace(
        "published mean",
        [name for name in published if name in colours],
        [mean for name, mean in published.items() if name in colours],
        {"symbol": "diamond-open", "size": 10, "color": "@ink"},
        hovertemplate="%{x}: %{y:.2f} % published<extra></extra>",
    )
    their_clips = compared["published"]["clip_means"]
    for split, label in SPLIT_LABELS.items():
        of_split = {e["configuration"]: e for e in compared["accuracy"] if e[split]["mean"] is not None}
        if not of_split:
            continue
        options[label] = [
            quantile_boxes(name, [entry[split]], colours[name], colours[name], x=[name], boxmean=True)
            for name, entry in of_split.items()
        ] + [marks] * bool(marks["x"])
        means = {name: clip_means(entry, split) for name, entry in of_split.items()}
        of_clips, theirs = (
            {name: [100 * v for v in values] for name, values in each.items()}
            for each in (means, their_clips)
        )
        options[f"{label}, a value for each clip"] = ours_and_published(list(of_split), of_clips, theirs)
    layout = {"yaxis": ERROR_AXIS, "showlegend": False}
    return parts.chart("compare-boxes", layout=layout, height=400, choose="Clips", options=options)


def clip_lines(compared: Compared) -> Chart | None:
    """Mean and standard deviation of the error of every clip, as lines: Figures 5.6 and 5.7 of Segerstedt.

    Our clips that are not among his 80 come first. Dotted lines are the published ones.
    """
    published, colours = compared["published"], parts.configuration_colours(compared)
    their_clips = compare.published_clips(published)
    measured = {(row["split"], row["clip"]) for entry in compared["accuracy"] for row in entry["clips"]}
    if not measured:
        return None
    order = [clip for _, clip in sorted(measured) if clip not in their_clips]
    if set(colours) & set(published["clip_means"]) or {clip for _, clip in measured} & set(their_clips):
        order += their_clips
    options: dict[str, list[Trace]] = {"mean": [], "standard deviation": []}
    hover = {"hovertemplate": "%{x}: %{y:.2f} %<extra>%{fullData.name}</extra>"}
    for lines, key, theirs in zip(options.values(), ("mean", "sd"), ("clip_means", "clip_sds"), strict=True):
        for entry in compared["accuracy"]:
            name, colour = entry["configuration"], colours[entry["configuration"]]
            rows = {r["clip"]: 100 * r.get("as_published", r)[key] for r in _measured(entry)}
            known = {clip: rows[clip] for clip in order if clip in rows}
            style = {"mode": "lines+markers", **hover}
            lines.append(parts.line_trace(name, list(known), list(known.values()), colour, **style))
            if values := published[theirs].get(name):
                y, dotted = [100 * value for value in values], {"dash": "dot", "width": 1.3, **hover}
                lines.append(parts.line_trace(f"{name}, published", their_clips, y, colour, **dotted))
    x = {"type": "category", **parts.ordered_axis(order), "showticklabels": len(order) < 40}
    layout = {"xaxis": x, "yaxis": ERROR_AXIS}
    return parts.chart("compare-clips", layout=layout, height=420, choose="Shown", options=options)


def difference_map(compared: Compared) -> Chart:
    """The difference of each two configurations. A menu selects the split and the kind of deviation."""
    names, options = parts.configuration_names(compared), {}
    hover, look = "%{y} and %{x}: %{z:.3f}<extra></extra>", {"texttemplate": "%{z:.2f}", "xgap": 3, "ygap": 3}
    for (split, label), (key, kind) in product(SPLIT_LABELS.items(), DEVIATIONS.items()):
        # compare.json has each pair in one order only.
        values = {frozenset((r["a"], r["b"])): r[key] for r in compared["difference"] if r["over"] == split}
        if any(value is not None for value in values.values()):
            cells = [[values.get(frozenset((a, b))) for b in names] for a in names]
            options[f"{label}, {kind}"] = [parts.heatmap(names, names, cells, hover, **look)]
    category = {"type": "category"}
    layout = {"xaxis": category, "yaxis": {**category, "autorange": "reversed", "automargin": True}}
    height, choose = max(240, 90 + 42 * len(names)), "Clips and deviation"
    return parts.chart("compare-difference", layout=layout, height=height, choose=choose, options=options)
