"""How well the network predicts the next frame, on training and held-out clips.

The relative error of a joint (eq. 3.1 of Segerstedt 2021) is the distance between its predicted and its
captured position, divided by its distance from the root. JSON files have it as a fraction, pages show it in
%. `found` is the content of accuracy.json, or {} if accuracy was not measured.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial

from collections.abc import Iterator, Sequence
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
NAMES = {"held_out": "held out", "train": "training"}  # split -> its name on the page
# The keys of the 5th to 95th percentile of the error in accuracy.json.
QUANTILES = ("p05", "p25", "p50", "p75", "p95")
# Columns of the table of clips.
CLIP_COLUMNS = ("clip", "split", "frames", "mean", "sd", "position_error_cm", *QUANTILES)


def _rows(found: Json) -> list[dict[str, Any]]:
    """The entries of the clips that were measured: held-out clips first, each split by rising error."""
    rows = [row for row in found.get("clips", ()) if row.get("mean") is not None]
    return sorted(rows, key=lambda row: (row["split"] != "held_out", row["mean"]))


def clip_boxes(found: Json, material: ReportMaterial) -> Chart:
    """A box for each clip: quantiles of its error over frames and joints. Published means are diamonds.

    Held-out clips come first, then the others by their mean error. A line is at the published mean of all
    clips.
    """
    rows = [row for row in _rows(found)[::-1] if has_quantiles(row)]  # plotly puts the first at the bottom
    traces = []
    for split, fill, line in (("held_out", "@accent-wash", "@accent"), ("train", "@sunken", "@faint")):
        if chosen := [row for row in rows if row["split"] == split]:
            box = boxes(NAMES[split], chosen, COLOURS[split])
            place = {"orientation": "h", "y": [row["clip"] for row in chosen]}
            traces.append({**box, **place, "line": {"width": 1.4, "color": line}, "fillcolor": fill})
    theirs = _published_means(material.published, material.name)
    if shown := [row["clip"] for row in rows if row["clip"] in theirs]:
        diamond = {"symbol": "diamond-open", "size": 7, "color": "@ink"}
        traces.append(marker_trace("published mean", [100 * theirs[clip] for clip in shown], shown, diamond))
    published = material.published_entry("accuracy")
    mean = reference_line(100 * published["mean"], f"{published['label']}, published") if published else {}
    axes = {"xaxis": axis("relative error, %", rangemode="tozero")}
    axes["yaxis"] = ordered_axis(row["clip"] for row in rows)
    held_out = any(row["split"] == "held_out" for row in rows)
    return Chart(
        "accuracy-boxes",
        "Error of each clip",
        "The error of a joint is the distance between its predicted and its captured position, divided by "
        "its distance from the root (eq. 3.1 of Segerstedt). Each box holds the middle half of the errors "
        "of a clip. The solid line in it is the median, the dotted line the mean. Whiskers reach from the "
        "5th to the 95th percentile. A box near zero with a long whisker means that the clip is easy except "
        "for a few moments."
        + (" Held-out clips come first: the network was not trained on them." if held_out else ""),
        traces,
        {**axes, **mean, "boxmode": "overlay"},
        height=max(260, 110 + 21 * len(rows)),
    )


def boxes(name: str, errors: Sequence[Json], colour: str) -> Trace:
    """Plotly boxes of the relative error in %, one for each entry of accuracy.json in `errors`."""
    low, q1, median, q3, high = ([100 * entry[key] for entry in errors] for key in QUANTILES)
    fences = {"lowerfence": low, "q1": q1, "median": median, "q3": q3, "upperfence": high}
    mean = [100 * entry["mean"] for entry in errors]
    return {"type": "box", "name": name, **fences, "mean": mean, "marker": {"color": colour}}


def has_quantiles(row: Json) -> bool:
    """Whether the errors of a clip or a split have all QUANTILES."""
    return all(row.get(key) is not None for key in QUANTILES)


def accuracy_table(found: Json, name: str) -> Table:
    """A row for each clip that was measured: its number of frames and its errors. name: the configuration."""
    columns = {
        "clip": Column("clip"),
        "split": Column("split", lambda value: NAMES.get(value, value)),
        "frames": Column.count("frames"),
        "mean": Column.number("mean"),
        "sd": Column.number("sd"),
        "position_error_cm": Column.number("position error, cm"),
    }
    return Table.of(f"{name}-accuracy", columns, _rows(found))


def published_table(found: Json, material: ReportMaterial) -> Table:
    """Means and standard deviations of the clips' mean errors: ours on both splits, then the published ones.

    Ours are measured as the published ones were, see `measure_accuracy` in `hobble.measures.accuracy_run`.
    """
    rows: list[list[Any]] = []
    for split, name in NAMES.items():
        part = found.get(split) or {}
        if ours := part.get("as_published"):
            row = [ours["mean_of_clips"], ours["sd_of_clips"], part.get("position_error_cm")]
            rows.append([f"{material.name}, {name} clips", *row, "this report"])
    sources = material.published["sources"]
    for entry in material.published["accuracy"]:
        rows.append([entry["label"], entry["mean"], entry["sd"], None, citation(entry, sources)])
    columns = [
        Column("network"),
        Column.number("mean error of the clips, as a fraction"),
        Column.number("sd of these means"),
        Column.number("position error, cm (all frames, exact phase)"),
        Column("source", kind="long"),
    ]
    title = (
        "Comparison with published results (phase mode constant, at most 500,000 joint positions of a clip)"
    )
    return Table(f"{material.name}-published", columns, rows, title)


def _published_means(published: Json, configuration: str) -> dict[str, float]:
    """Clip -> published mean error of the network of a configuration; {} if there are none."""
    means = published["clip_means"].get(configuration)
    return dict(zip(published_clips(published), means, strict=True)) if means else {}


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
            SectionPart(30, clip_boxes(found, material), tall=True),
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
    elif train.get("mean"):
        ratio = held_out["mean"] / train["mean"]
        words = "The error on held-out clips is {} times the error on training clips"
        if ratio > 1.5:
            advice = "The network overfits. Add more varied clips (speeds, turns, performers) before you "
            advice += "make the network larger or train it longer."
            yield Hint("warn", f"{words.format(f'{ratio:.1f}')}.", advice)
        elif ratio < 1.2:
            head = f"{words.format(f'{ratio:.2f}')}, so the network does not overfit."
            yield Hint("good", head, "A larger network may do better.")
        else:
            yield Hint("fact", f"{words.format(f'{ratio:.2f}')}.", "That is usual.")


def _worst_clip(found: Json) -> Iterator[Hint]:
    """A hint on the clip with the largest error, if that is far above the median of all clips."""
    rows = [row for row in found.get("clips", ()) if row.get("mean") is not None]
    if len(rows) < 4:
        return
    median = float(np.median([row["mean"] for row in rows]))
    worst = max(rows, key=lambda row: row["mean"])
    if worst["mean"] > 1.8 * median:
        source = worst["clip"].removesuffix("_mirror")
        whose = "its labels" if source == worst["clip"] else f"the labels of {source}, which it mirrors,"
        yield Hint(
            "note",
            f"{worst['clip']} has the largest error,",
            f"{worst['mean'] / median:.1f} times the median over all clips. "
            f"Look at it under Accuracy, and check {whose} with `hobble labels`.",
        )


NAME = "accuracy"  # name of the measurement
# split -> its name in texts for users
SPLIT_NAMES = {"train": "training", "held_out": "held-out"}


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """The errors of each configuration, the difference of each pair, and the published errors beside ours.

    all_measured: the results of each configuration. published: the content of published.yaml.
    """
    differences = accuracy_differences(all_measured)
    on_training = [row for row in differences if row["over"] == "train"]
    return ComparisonAddition(
        entries=[{"dataset": m.dataset, **m.results_of(NAME), "configuration": m.name} for m in all_measured],
        about={m.name: {"joints": m.results_of(NAME)["joints"]} for m in all_measured},
        differences=differences,
        against_published=[
            *_published_splits(all_measured, published),
            *published_differences("error", on_training, published),
            *_published_clips(all_measured, published),
        ],
    )


def tables(compared: Json) -> dict[str, list[Row]]:
    """Name -> rows of a CSV table: the errors of every clip in every configuration; Tables A.4 and A.5.

    compared: the content of compare.json.
    """
    rows: list[Row] = [
        {"configuration": entry["configuration"], **{key: clip.get(key) for key in CLIP_COLUMNS}}
        for entry in compared[NAME]
        for clip in entry["clips"]
    ]
    return {NAME: rows, "published-clips": published_clip_rows(compared)}


def published_clip_rows(compared: Json) -> list[Row]:
    """Tables A.4 and A.5 of Segerstedt (2021): a row for each clip and network, with ours beside it."""
    published, ours, rows = compared["published"], {}, list[Row]()
    for entry in compared[NAME]:
        for clip in entry["clips"]:
            ours[entry["configuration"], clip["clip"]] = clip.get("as_published") or {}
    for configuration, means in published["clip_means"].items():
        sds = published["clip_sds"].get(configuration, [None] * len(means))  # table A.5 has none for AVA
        clips = enumerate(zip(published_clips(published), means, sds, strict=True))
        for index, (clip, mean, sd) in clips:
            found = ours.get((configuration, clip), {})
            rows.append(
                {
                    "index": index,
                    "clip": clip,
                    "configuration": configuration,
                    "published_mean": mean,
                    "published_sd": sd,
                    "mean": found.get("mean"),
                    "sd": found.get("sd"),
                }
            )
    return rows


def accuracy_differences(all_measured: Sequence[ConfigurationResults]) -> list[dict[str, Any]]:
    """The difference between the errors of each two configurations, by eq. 3.2 of Segerstedt 2021.

    There is a row for each split and each clip on which both configurations were measured. `over` is the name
    of this split or clip.
    """
    series = {m.name: _series(m.results_of(NAME)) for m in all_measured}
    return [
        {"a": a, "b": b, "over": over, **compare_series(series[a][over], series[b][over])}
        for a, b in combinations(series, 2)
        for over in series[a]
        if over in series[b] and series[a][over]["frames"] and series[b][over]["frames"]
    ]


def _series(found: Json) -> dict[str, Json]:
    """Split or clip -> its errors. A split also has `means`, the mean errors of its clips."""
    splits = {split: {**found[split], "means": clip_means(found, split)} for split in SPLITS}
    return {**splits, **{entry["clip"]: entry for entry in found["clips"]}}


def clip_means(found: Json, split: str) -> list[float]:
    """The mean error of each clip of a split that has one, as published ones were measured if possible.

    found: the content of accuracy.json.
    """
    clips = [c for c in found["clips"] if c["split"] == split and c["mean"] is not None]
    return [c.get("as_published", c)["mean"] for c in clips]


def _published_splits(all_measured: Sequence[ConfigurationResults], published: Json) -> list[dict[str, Any]]:
    """Published means and standard deviations of the clips' errors, beside ours on each split."""
    by_name = {m.name: m.results_of(NAME) for m in all_measured}
    out = []
    for row in published["accuracy"]:
        found = by_name.get(row["configuration"])
        for split in SPLITS:
            clips = f"{SPLIT_NAMES[split]} clips"
            mean, sd = mean_and_sd(clip_means(found, split) if found else [])
            out.append(published_row(f"relative error, {clips}", row, row["mean"], mean))
            out.append(published_row(f"standard deviation of the means of {clips}", row, row["sd"], sd))
    return out


def _published_clips(all_measured: Sequence[ConfigurationResults], published: Json) -> list[dict[str, Any]]:
    """Errors of the network that Holden et al. released on three clips, beside ours on these clips."""
    return [
        published_row(
            f"relative error, {clip['clip']}",
            {"configuration": results.name, "source": "release"},
            published["released_clips"][clip["clip"]],
            clip.get("as_published", clip)["mean"],
        )
        for results in all_measured
        for clip in results.results_of(NAME)["clips"]
        if clip["clip"] in published["released_clips"]
    ]


# The difference between two configurations is the difference of their mean errors, divided by standard
# deviations (sd; eq. 3.2 of Segerstedt 2021). compare.json has it twice, with different standard deviations.
# Key of the difference -> what it is divided by, for the menu of the chart.
DEVIATIONS = {"difference_of_means": "sd of the means of clips", "difference": "sd of single frames"}


def compared_section(compared: Compared) -> PageSection:
    """The spread of the errors, differences between configurations, and errors of single clips."""
    # The first argument of each part is its place in the section, from 0 (top) to 100 (end).
    return PageSection(
        "accuracy",
        [
            SectionPart(10, error_boxes(compared)),
            SectionPart(30, difference_map(compared)),
            SectionPart(50, clip_lines(compared)),
            SectionPart(60, published_clips_table(compared)),
        ],
        title="Accuracy",
        order=10,
        long=True,
    )


def compared_columns(compared: Compared) -> Iterator[OverviewColumn]:
    """Columns for the table of configurations: the error on each split, and the number of measured joints."""
    entries = {entry["configuration"]: entry for entry in compared["accuracy"]}
    for at, split, label in ((10, "held_out", "held-out error"), (20, "train", "training error")):
        values = {name: entry[split]["mean"] for name, entry in entries.items()}
        yield OverviewColumn(at, Column(label, _percent, "n"), values)
    yield OverviewColumn(
        70, Column.count("joints"), {name: entry["joints"] for name, entry in entries.items()}
    )


def error_boxes(compared: Compared) -> Chart:
    """A box for each configuration: the spread of its error over all frames of a split. A menu selects it."""
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
        traces = []
        for entry in compared["accuracy"]:
            name = entry["configuration"]
            if has_quantiles(entry[split]):
                line = {"width": 1.6, "color": colours[name]}
                box = boxes(name, [entry[split]], colours[name])
                traces.append({**box, "x": [name], "boxmean": True, "line": line})
        if traces:
            options[label] = [*traces, marks] if published else traces
        options |= _boxes_of_means(compared, split, f"{label}, a value for each clip")
    return Chart(
        "compare-boxes",
        "Spread of the error",
        "Each box holds the middle half of the relative errors of all frames (eq. 3.1 of Segerstedt). The "
        "solid line is the median, the dashed line the mean. Whiskers reach from the 5th to the 95th "
        "percentile. Diamonds are published means, measured on other data. With a value for each clip, as in "
        "Figure 5.8 of Segerstedt, boxes are of the means of clips, ours and those of his 80 clips.",
        layout={"yaxis": axis("relative error, %", rangemode="tozero"), "showlegend": False},
        height=400,
        choose="Clips",
        options=options,
    )


def _boxes_of_means(compared: Compared, split: str, label: str) -> dict[str, list[Trace]]:
    """{label: boxes of the means of clips}, published ones beside ours; {} without clips in the split."""
    traces: list[Trace] = []
    for entry in compared["accuracy"]:
        name = entry["configuration"]
        theirs = [("published", compared["published"]["clip_means"].get(name, ()), "@muted")]
        for whose, means, colour in [("ours", clip_means(entry, split), "@accent"), *theirs]:
            if len(means):
                y = [100 * mean for mean in means]
                box = {"type": "box", "name": f"{name}, {whose}", "y": y, "boxmean": True, "boxpoints": False}
                traces.append({**box, "line": {"width": 1.6, "color": colour}})
    return {label: traces} if any(clip_means(entry, split) for entry in compared["accuracy"]) else {}


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
    for label, key, theirs in (("mean", "mean", "clip_means"), ("standard deviation", "sd", "clip_sds")):
        traces = options.setdefault(label, [])
        for entry in compared["accuracy"]:
            name, means = entry["configuration"], published[theirs].get(entry["configuration"])
            rows = {r["clip"]: r.get("as_published", r)[key] for r in entry["clips"] if r["mean"] is not None}
            known = [clip for clip in order if clip in rows]
            hover = {"hovertemplate": "%{x}: %{y:.2f} %<extra>%{fullData.name}</extra>"}
            y = [100 * rows[clip] for clip in known]
            traces.append(line_trace(name, known, y, colours[name], mode="lines+markers", **hover))
            if means:
                y = [100 * mean for mean in means]
                whose = f"{name}, published"
                traces.append(
                    line_trace(whose, their_clips, y, colours[name], dash="dot", width=1.3, **hover)
                )
    caption = (
        "The error of every clip in the phase mode constant, on its first 500,000 joint positions, as "
        "Segerstedt measured it. Dotted lines are his, on the 80 clips of Holden et al. Ours are above the "
        "same clips if we have them. (His table of standard deviations has none for AVA.)"
    )
    x = {"type": "category", **ordered_axis(order), "showticklabels": len(order) < 40}
    layout = {"xaxis": x, "yaxis": axis("relative error, %", rangemode="tozero")}
    return Chart(
        "compare-clips", "Error of each clip", caption, (), layout, 420, choose="Shown", options=options
    )


def published_clips_table(compared: Compared) -> Table:
    """Tables A.4 and A.5 of Segerstedt (2021), with ours of the same clips."""
    rows = published_clip_rows(compared)
    columns = {key: Column.number(key.replace("_", " "), 4) for key in rows[0]}
    columns |= {
        "clip": Column("clip"),
        "configuration": Column("configuration"),
        "index": Column.count("index"),
    }
    return Table.of("compare-published-clips", columns, rows, "Tables A.4 and A.5 of Segerstedt, and ours")


def difference_map(compared: Compared) -> Chart:
    """The difference of each two configurations. A menu selects the split and the kind of deviation."""
    names, options = configuration_names(compared), {}
    hover, look = "%{y} and %{x}: %{z:.3f}<extra></extra>", {"texttemplate": "%{z:.2f}", "xgap": 3, "ygap": 3}
    for (split, label), (key, kind) in product(SPLIT_LABELS.items(), DEVIATIONS.items()):
        values = {(r["a"], r["b"]): r[key] for r in compared["difference"] if r["over"] == split}
        if any(value is not None for value in values.values()):
            # compare.json has each pair in one order only, (a, b) or (b, a).
            cells = [[values.get((a, b), values.get((b, a))) for b in names] for a in names]
            options[f"{label}, {kind}"] = [heatmap(names, names, cells, hover, **look)]
    return Chart(
        "compare-difference",
        "Difference between two configurations",
        "Eq. 3.2 of Segerstedt: twice the difference of the two means, divided by the sum of the two "
        "standard deviations. Segerstedt uses the standard deviation of the clips' means. The standard "
        "deviation of single frames is several times as large. A value of 1 says that the means are one "
        "standard deviation apart. Our rule of thumb: differences under 0.2 are too small to matter.",
        layout={
            "xaxis": {"type": "category"},
            "yaxis": {"type": "category", "autorange": "reversed", "automargin": True},
        },
        height=max(240, 90 + 42 * len(names)),
        choose="Clips and deviation",
        options=options,
    )


def _percent(value: Any) -> str:
    return f"{100 * float(value):.2f} %"
