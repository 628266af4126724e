"""How well the network predicts the next frame, on training and held-out clips.

The relative error of a joint (eq. 3.1 of Segerstedt 2021) is the distance between its predicted and its
captured position, divided by its distance from the root. JSON files have it as a fraction, pages show it in
%. `found` is the content of accuracy.json, or {} if accuracy was not measured.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, product
from typing import Any

import numpy as np

from hobble.core.files import Json
from hobble.measures.compare import (
    ComparisonAddition,
    ConfigurationResults,
    compare_series,
    mean_and_sd,
    published_clips,
    published_differences,
    published_row,
)
from hobble.measures.measure import SPLITS, Cost, JointOptions, Measure, Row, SampleOptions, sample_in_words
from hobble.measures.shown import boxes, chart, table, words
from hobble.report.parts import SPLITS as SPLIT_LABELS
from hobble.report.parts import (
    Chart,
    Column,
    Compared,
    Hint,
    KeyFigure,
    OverviewColumn,
    PageSection,
    Paragraph,
    SectionPart,
    Table,
    TemplatePart,
    Trace,
    axis,
    citation,
    configuration_colours,
    configuration_names,
    format_duration,
    format_number,
    heatmap,
    line_trace,
    marker_trace,
    ordered_axis,
    reference_line,
    with_order,
)


class Options(JointOptions, SampleOptions):
    """The keys of this measurement in a configuration's section `evaluation`."""


MEASURE = Measure(
    name="accuracy",
    module=__name__,
    inputs=("weights", "clips", "summaries", "skeleton"),
    options=Options,
    # For each thousand frames: 12 MB and 0.2 s. At least 10 minutes.
    cost=Cost(mb_per_1000_frames=12, seconds_per_1000_frames=0.2, least_minutes=10),
)
COLOURS = {"train": "@muted", "held_out": "@accent"}  # split -> its colour in the charts
NAMES = {"held_out": "held out", "train": "training"}  # split -> its name on the page
# The keys of the 5th to 95th percentile of the error in accuracy.json.
QUANTILES = ("p05", "p25", "p50", "p75", "p95")
CLIP_COLUMNS = ("clip", "split", "frames", "mean", "sd", "position_error_cm", *QUANTILES)
ERROR_AXIS = axis("relative error, %", rangemode="tozero")
# Key of a difference between two configurations in compare.json -> what it is divided by (eq. 3.2).
DEVIATIONS = {"difference_of_means": "sd of the means of clips", "difference": "sd of single frames"}


def section(found: Json, material: ReportMaterial) -> PageSection:
    """Charts, tables, and a view of captured and predicted motion. Empty without measured clips."""
    if not found.get("clips"):
        return PageSection("accuracy", [])
    # Readers may take the number in _hurt1 for a severity, so endings of names are explained.
    endings = [end for end in ("_hurt1", "_mirror") if any(end in row["clip"] for row in found["clips"])]
    introduction = words("accuracy.introduction", *(f"accuracy.{end[1:]}" for end in endings))
    heads = {key: "position error, cm" if key == "position_error_cm" else key for key in CLIP_COLUMNS[:6]}
    of_clips = table(f"{material.name}-accuracy", _measured(found), heads, show={"split": NAMES.__getitem__})
    # Only gait cycles are measured, so the clips are longer.
    seconds = sum(found[split]["frames"] for split in NAMES) / 60
    caveat = words("accuracy.caveat", duration=format_duration(seconds), dataset=material.dataset)
    parts = [
        SectionPart(0, Paragraph(introduction + _about_sample(found))),
        SectionPart(9, Paragraph(caveat)),
        SectionPart(10, published_table(found, material), open=True, short=True),
        SectionPart(30, clip_boxes(found, material), tall=True),
        SectionPart(60, of_clips),
        SectionPart(90, TemplatePart("captured.html.j2")),
    ]
    return PageSection("accuracy", parts, title="Accuracy", order=10, long=True)


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
    return " " + words("accuracy.sample", sample=sample_in_words(found), means=", ".join(means))


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
    theirs = dict(zip(published_clips(material.published), means, strict=False))
    if shown := [row["clip"] for row in rows if row["clip"] in theirs]:
        diamond = {"symbol": "diamond-open", "size": 7, "color": "@ink"}
        traces.append(marker_trace("published mean", [100 * theirs[clip] for clip in shown], shown, diamond))
    published = material.published_entry("accuracy")
    mean = reference_line(100 * published["mean"], f"{published['label']}, published") if published else {}
    clips = ordered_axis(row["clip"] for row in rows)
    layout = {"xaxis": ERROR_AXIS, "yaxis": clips, **mean, "boxmode": "overlay"}
    more = ["held_out"] if any(row["split"] == "held_out" for row in rows) else []
    return chart("accuracy-boxes", traces, layout, max(260, 110 + 21 * len(rows)), more=more)


def quantile_boxes(name: str, errors: Sequence[Json], colour: str, line: str, **more: Any) -> Trace:
    """Boxes of the relative error in %, one for each entry of accuracy.json in `errors`."""
    keys = zip(("lowerfence", "q1", "median", "q3", "upperfence", "mean"), (*QUANTILES, "mean"), strict=True)
    values = {key: [100 * entry[of_entry] for entry in errors] for key, of_entry in keys}
    return boxes(name, line, **values, marker={"color": colour}, **more)


def published_table(found: Json, material: ReportMaterial) -> Table:
    """Means and standard deviations of the clips' mean errors: ours on both splits, then the published ones.

    Ours are measured as the published ones were, see `measure_accuracy` in `hobble.measures.accuracy_run`.
    """
    rows: list[Row] = []
    for split, name in NAMES.items():
        if ours := found[split].get("as_published"):
            of_split = {"mean": ours["mean_of_clips"], "sd": ours["sd_of_clips"], "source": "this report"}
            cm = found[split]["position_error_cm"]
            rows.append({"network": f"{material.name}, {name} clips", **of_split, "cm": cm})
    for entry in material.published["accuracy"]:
        source = citation(entry, material.published["sources"])
        rows.append({"network": entry["label"], **entry, "source": source})
    heads = {
        "network": "network",
        "mean": "mean error of the clips, as a fraction",
        "sd": "sd of these means",
        "cm": "position error, cm (all frames, exact phase)",
        "source": "source",
    }
    return table(f"{material.name}-published", rows, heads, words("accuracy.published"), long=["source"])


def figures(found: Json, material: ReportMaterial) -> Iterator[KeyFigure]:
    """The key figures: the error on each split that was measured."""
    for order, (split, label) in enumerate(SPLIT_LABELS.items(), 10):
        part = found.get(split)
        if part and part["mean"] is not None:
            note = f"of a joint's distance from the root; {_centimetres(part, split, material)}"
            if (published := material.published_entry("accuracy")) and split == "held_out":
                mean = 100 * published["mean"]
                note += f"; published for {published['label']}: {mean:.2f} %, on other clips"
            yield KeyFigure(f"Error on {label}", f"{100 * part['mean']:.2f}", "%", note, order)


def _centimetres(part: Json, split: str, material: ReportMaterial) -> str:
    """The mean position error in words: of the predicted joints, and of the joints as the runtime draws them.

    The runtime draws a joint halfway between its predicted position and its old position plus the predicted
    velocity. This error is left out if the measurement `rollouts` has no roll-outs of one frame.
    """
    error = format_number(part["position_error_cm"])
    lengths = {entry["length"]: entry for entry in material.results_of("rollouts").get("lengths", ())}
    drawn = lengths.get(1, {}).get(split, {}).get("position_error_cm")
    if drawn is None:
        return f"{error} cm per joint on average"
    return f"{error} cm per joint as predicted; {format_number(drawn)} cm as drawn (explained under Accuracy)"


def hints(found: Json, material: ReportMaterial) -> Iterator[Hint]:
    """How well the network generalises, and which clip has the largest error."""
    # Places of hints (`Hint.order`): under 20 for advice on the data, 30 for advice on the network.
    train, held_out = ((found.get(split) or {}).get("mean") for split in SPLITS)
    if held_out is None:
        yield Hint("warn", "No clips were held out.", words("accuracy.none-held-out"), 10)
    elif train:
        ratio = held_out / train
        many = f"{ratio:.1f}" if ratio > 1.5 else f"{ratio:.2f}"
        head = f"The error on held-out clips is {many} times the error on training clips"
        if ratio > 1.5:
            yield Hint("warn", f"{head}.", words("accuracy.overfits"), 30)
        elif ratio < 1.2:
            head += ", so the network does not overfit."
            yield Hint("good", head, "A larger network may do better.", 30)
        else:
            yield Hint("fact", f"{head}.", "That is usual.", 30)
    yield from with_order(12, _worst_clip(_measured(found)))


def _worst_clip(rows: Sequence[Json]) -> Iterator[Hint]:
    """A hint on the clip with the largest error, if that is far above the median of all clips."""
    if len(rows) < 4:
        return
    median = float(np.median([row["mean"] for row in rows]))
    worst = max(rows, key=lambda row: row["mean"])
    if worst["mean"] > 1.8 * median:
        source = worst["clip"].removesuffix("_mirror")
        whose = "its labels" if source == worst["clip"] else f"the labels of {source}, which it mirrors,"
        text = words("accuracy.worst", times=f"{worst['mean'] / median:.1f}", whose=whose)
        yield Hint("note", f"{worst['clip']} has the largest error,", text)


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """The errors of each configuration, the difference of each pair, and the published errors beside ours.

    all_measured: the results of each configuration. published: the content of published.yaml.
    """
    found = {m.name: m.results_of("accuracy") for m in all_measured}
    differences = accuracy_differences(found)
    ours = []
    for row in published["accuracy"]:
        for split in SPLITS:
            clips, label = found.get(row["configuration"]), SPLIT_LABELS[split]
            mean, sd = mean_and_sd(clip_means(clips, split) if clips else [])
            ours.append(published_row(f"relative error, {label}", row, row["mean"], mean))
            ours.append(published_row(f"standard deviation of the means of {label}", row, row["sd"], sd))
    # Errors of the network that Holden et al. released on three clips, beside ours on these clips.
    of_release = [
        published_row(
            f"relative error, {clip['clip']}",
            {"configuration": name, "source": "release"},
            published["released_clips"][clip["clip"]],
            clip.get("as_published", clip)["mean"],
        )
        for name, of_configuration in found.items()
        for clip in of_configuration["clips"]
        if clip["clip"] in published["released_clips"]
    ]
    on_training = [row for row in differences if row["over"] == "train"]
    return ComparisonAddition(
        entries=[{"dataset": m.dataset, **found[m.name], "configuration": m.name} for m in all_measured],
        about={name: {"joints": of_configuration["joints"]} for name, of_configuration in found.items()},
        differences=differences,
        against_published=[*ours, *published_differences("error", on_training, published), *of_release],
    )


def tables(compared: Json) -> dict[str, list[Row]]:
    """Name -> rows of a CSV table: the errors of every clip in every configuration; Tables A.4 and A.5.

    compared: the content of compare.json.
    """
    rows: list[Row] = [
        {"configuration": entry["configuration"], **{key: clip.get(key) for key in CLIP_COLUMNS}}
        for entry in compared["accuracy"]
        for clip in entry["clips"]
    ]
    return {"accuracy": rows, "published-clips": published_clip_rows(compared)}


def published_clip_rows(compared: Json) -> list[Row]:
    """Tables A.4 and A.5 of Segerstedt (2021): a row for each clip and network, with ours beside it."""
    published = compared["published"]
    ours = {
        (entry["configuration"], clip["clip"]): clip.get("as_published", {})
        for entry in compared["accuracy"]
        for clip in entry["clips"]
    }
    rows: list[Row] = []
    for name, means in published["clip_means"].items():
        sds = published["clip_sds"].get(name, [None] * len(means))  # table A.5 has none for AVA
        for index, (clip, *theirs) in enumerate(zip(published_clips(published), means, sds, strict=True)):
            found = ours.get((name, clip), {})
            row = {"index": index, "clip": clip, "configuration": name}
            row |= dict(zip(("published_mean", "published_sd"), theirs, strict=True))
            rows.append(row | {key: found.get(key) for key in ("mean", "sd")})
    return rows


def accuracy_differences(found: Mapping[str, Json]) -> list[dict[str, Any]]:
    """The difference between the errors of each two configurations, by eq. 3.2 of Segerstedt 2021.

    There is a row for each split and each clip on which both configurations were measured. `over` is the name
    of this split or clip. found: configuration -> content of its accuracy.json.
    """
    series = {
        name: {split: {**of[split], "means": clip_means(of, split)} for split in SPLITS}
        | {entry["clip"]: entry for entry in of["clips"]}
        for name, of in found.items()
    }
    return [
        {"a": a, "b": b, "over": over, **compare_series(series[a][over], series[b][over])}
        for a, b in combinations(series, 2)
        for over in series[a]
        if over in series[b] and series[a][over]["frames"] and series[b][over]["frames"]
    ]


def clip_means(found: Json, split: str) -> list[float]:
    """The mean error of each clip of a split that has one, as published ones were measured if possible."""
    clips = [c for c in found["clips"] if c["split"] == split and c["mean"] is not None]
    return [c.get("as_published", c)["mean"] for c in clips]


def compared_section(compared: Compared) -> PageSection:
    """The spread of the errors, differences between configurations, and errors of single clips."""
    clips = table(
        "compare-published-clips", published_clip_rows(compared), title=words("accuracy.published-clips")
    )
    parts = [
        SectionPart(10, error_boxes(compared)),
        SectionPart(30, difference_map(compared)),
        SectionPart(50, clip_lines(compared)),
        SectionPart(60, clips),
    ]
    return PageSection("accuracy", parts, title="Accuracy", order=10, long=True)


def compared_columns(compared: Compared) -> Iterator[OverviewColumn]:
    """Columns for the table of configurations: the error on each split, and the number of measured joints."""
    entries = {entry["configuration"]: entry for entry in compared["accuracy"]}
    for order, split, label in ((10, "held_out", "held-out error"), (20, "train", "training error")):
        values = {name: entry[split]["mean"] for name, entry in entries.items()}
        yield OverviewColumn(order, Column(label, lambda value: f"{100 * value:.2f} %", "n"), values)
    joints = {name: entry["joints"] for name, entry in entries.items()}
    yield OverviewColumn(70, Column.count("joints"), joints)


def error_boxes(compared: Compared) -> Chart:
    """A box for each configuration: the spread of its error over all frames of a split. A menu selects it.

    With a value for each clip, boxes are of the means of clips, published ones beside ours.
    """
    colours, options = configuration_colours(compared), {}
    published = [row for row in compared["published"]["accuracy"] if row["configuration"] in colours]
    marks = marker_trace(
        "published mean",
        [row["configuration"] for row in published],
        [100 * row["mean"] for row in published],
        {"symbol": "diamond-open", "size": 10, "color": "@ink"},
        hovertemplate="%{x}: %{y:.2f} % published<extra></extra>",
    )
    for split, label in SPLIT_LABELS.items():
        of_split = {e["configuration"]: e for e in compared["accuracy"] if e[split]["mean"] is not None}
        if not of_split:
            continue
        options[label] = [
            quantile_boxes(name, [entry[split]], colours[name], colours[name], x=[name], boxmean=True)
            for name, entry in of_split.items()
        ] + [marks] * bool(published)
        options[f"{label}, a value for each clip"] = [
            boxes(f"{name}, {whose}", colour, y=[100 * mean for mean in means], boxmean=True)
            for name, entry in of_split.items()
            for whose, means, colour in (
                ("ours", clip_means(entry, split), "@accent"),
                ("published", compared["published"]["clip_means"].get(name, ()), "@muted"),
            )
            if len(means)
        ]
    layout = {"yaxis": ERROR_AXIS, "showlegend": False}
    return chart("compare-boxes", layout=layout, height=400, choose="Clips", options=options)


def clip_lines(compared: Compared) -> Chart | None:
    """Mean and standard deviation of the error of every clip, as lines: Figures 5.6 and 5.7 of Segerstedt.

    Our clips that are not among his 80 come first. Dotted lines are the published ones.
    """
    published, colours = compared["published"], configuration_colours(compared)
    their_clips = published_clips(published)
    measured = {(row["split"], row["clip"]) for entry in compared["accuracy"] for row in entry["clips"]}
    if not measured:
        return None
    order = [clip for _, clip in sorted(measured) if clip not in their_clips]
    if set(colours) & set(published["clip_means"]) or {clip for _, clip in measured} & set(their_clips):
        order += their_clips
    options: dict[str, list[Trace]] = {}
    hover = {"hovertemplate": "%{x}: %{y:.2f} %<extra>%{fullData.name}</extra>"}
    for label, key, theirs in (("mean", "mean", "clip_means"), ("standard deviation", "sd", "clip_sds")):
        lines = options.setdefault(label, [])
        for entry in compared["accuracy"]:
            name, colour = entry["configuration"], colours[entry["configuration"]]
            rows = {r["clip"]: 100 * r.get("as_published", r)[key] for r in _measured(entry)}
            known = [clip for clip in order if clip in rows]
            ours = [rows[clip] for clip in known]
            lines.append(line_trace(name, known, ours, colour, mode="lines+markers", **hover))
            if values := published[theirs].get(name):
                y, dotted = [100 * value for value in values], {"dash": "dot", "width": 1.3, **hover}
                lines.append(line_trace(f"{name}, published", their_clips, y, colour, **dotted))
    x = {"type": "category", **ordered_axis(order), "showticklabels": len(order) < 40}
    layout = {"xaxis": x, "yaxis": ERROR_AXIS}
    return chart("compare-clips", layout=layout, height=420, choose="Shown", options=options)


def difference_map(compared: Compared) -> Chart:
    """The difference of each two configurations. A menu selects the split and the kind of deviation."""
    names, options = configuration_names(compared), {}
    hover, look = "%{y} and %{x}: %{z:.3f}<extra></extra>", {"texttemplate": "%{z:.2f}", "xgap": 3, "ygap": 3}
    for (split, label), (key, kind) in product(SPLIT_LABELS.items(), DEVIATIONS.items()):
        # compare.json has each pair in one order only.
        values = {
            pair: r[key]
            for r in compared["difference"]
            if r["over"] == split
            for pair in ((r["a"], r["b"]), (r["b"], r["a"]))
        }
        if any(value is not None for value in values.values()):
            cells = [[values.get((a, b)) for b in names] for a in names]
            options[f"{label}, {kind}"] = [heatmap(names, names, cells, hover, **look)]
    layout = {
        "xaxis": {"type": "category"},
        "yaxis": {"type": "category", "autorange": "reversed", "automargin": True},
    }
    height, choose = max(240, 90 + 42 * len(names)), "Clips and deviation"
    return chart("compare-difference", layout=layout, height=height, choose=choose, options=options)
