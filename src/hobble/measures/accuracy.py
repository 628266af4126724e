"""How well the network predicts the next frame, and how well it goes on from its own poses, on both splits.

The relative error of a joint (eq. 3.1 of Segerstedt 2021) is the distance between its predicted and its
captured position, divided by its distance from the root. JSON files have it as a fraction, pages show it in
%. `found` is the content of accuracy.json, or {} if accuracy was not measured.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field

from hobble.core.files import Json
from hobble.core.section import Positive
from hobble.measures import compare, measure
from hobble.measures.measure import SPLITS, Row
from hobble.measures.shown import ours_and_published
from hobble.report import parts
from hobble.report.parts import SPLITS as SPLIT_LABELS
from hobble.report.parts import Chart, Compared, Hint, PageSection, SectionPart, Trace

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial


class Options(measure.SampleOptions):
    """The keys of this measurement in a configuration's section `evaluation`."""

    joints: Literal["all", "equivalent"] = Field(
        "all", description="`equivalent`: only the joints that have a counterpart on the skeleton holden31"
    )
    rollouts: tuple[Positive, ...] = Field(
        (1, 10, 60, 300), min_length=1, description="lengths of roll-outs, in frames"
    )


MEASURE = measure.Measure(
    name="accuracy",
    module=__name__,
    inputs=("weights", "clips", "summaries", "skeleton"),
    options=Options,
    runtime=("mode",),
    cost=measure.Cost(memory_mb=120, mb_per_1000_frames=30, seconds_per_1000_frames=0.8, least_minutes=30),
)
FRAMES_PER_SECOND = 60
COLOURS = {"train": "@muted", "held_out": "@accent"}  # split -> its colour in the charts
NAMES = {"held_out": "held out", "train": "training"}  # split -> its name on the page
CLIP_HEADS = {
    key: parts.in_words(key) for key in ("clip", "split", "frames", "mean", "sd", "position_error_cm")
}
ERROR_AXIS = parts.axis("relative error, %", rangemode="tozero")


def section(found: Json, material: ReportMaterial) -> PageSection:
    """Charts, tables, and a view of captured and predicted motion. Empty without measured clips."""
    if not found.get("clips"):
        return PageSection("accuracy", [])
    introduction = parts.words("accuracy.introduction")
    of_clips = parts.table(
        f"{material.name}-accuracy", _measured(found), CLIP_HEADS, show={"split": NAMES.__getitem__}
    )
    # Only gait cycles are measured, so the clips are longer.
    seconds = sum(found[split]["frames"] for split in NAMES) / 60
    duration = parts.format_duration(seconds)
    shown = [
        SectionPart(0, parts.Paragraph(introduction + measure.sample_sentence(found))),
        SectionPart(
            9, parts.Paragraph(parts.words("accuracy.caveat", duration=duration, dataset=material.dataset))
        ),
        SectionPart(10, published_table(found, material), open=True),
        SectionPart(50, roll_out_chart(found)),
        SectionPart(60, of_clips),
        SectionPart(90, parts.TemplatePart("captured.html.j2")),
    ]
    return PageSection("accuracy", shown, title="Accuracy", order=10)


def _measured(found: Json) -> list[dict[str, Any]]:
    """The entries of the clips that were measured: held-out clips first, each split by rising error."""
    rows = [row for row in found.get("clips", ()) if row["mean"] is not None]
    return sorted(rows, key=lambda row: (row["split"] != "held_out", row["mean"]))


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
            centimetres = parts.format_number(part["position_error_cm"])
            note = f"of a joint's distance from the root; {centimetres} cm per joint on average"
            if interval := part.get("interval"):
                note += f"; 95 % confidence interval: ± {100 * interval['mean']:.2f} %"
            if (published := material.published_entry("accuracy")) and split == "held_out":
                mean = 100 * published["mean"]
                note += f"; published for {published['label']}: {mean:.2f} %, on other clips"
            yield parts.KeyFigure(f"Error on {label}", f"{100 * part['mean']:.2f}", "%", note, order)


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
    rows = _measured(found)
    median = float(np.median([row["mean"] for row in rows] or [0.0]))
    worst = max(rows, key=lambda row: row["mean"], default=None)
    if worst and len(rows) > 3 and worst["mean"] > 1.8 * median:
        source = worst["clip"].removesuffix("_mirror")
        whose = "its labels" if source == worst["clip"] else f"the labels of {source}, which it mirrors,"
        text = parts.words("accuracy.worst", times=f"{worst['mean'] / median:.1f}", whose=whose)
        yield Hint("note", f"{worst['clip']} has the largest error,", text, 12)


def compared(
    all_measured: Sequence[compare.ConfigurationResults], published: Json
) -> compare.ComparisonAddition:
    """The errors of each configuration, the difference of each pair, and the published errors beside ours.

    all_measured: the results of each configuration. published: the content of published.yaml.

    Two configurations are compared over each split, by the means of its clips. The errors of the network that
    Holden et al. released are beside those of any network on the same clips.
    """
    found = {m.name: m.results_of("accuracy") for m in all_measured}
    means = {name: {split: clip_means(of, split) for split in SPLITS} for name, of in found.items()}
    differences, beside = compare.pair_differences(means), []
    for split in SPLITS:
        statistics = {name: measure.mean_and_sd(of[split]) for name, of in means.items()}
        of_means = f"standard deviation of the means of {SPLIT_LABELS[split]}"
        for at, key, what in ((0, "mean", f"relative error, {SPLIT_LABELS[split]}"), (1, "sd", of_means)):
            ours = {name: values[at] for name, values in statistics.items()}
            beside += compare.beside_ours(what, published["accuracy"], key, ours)
    on_training = [row for row in differences if row["over"] == "train"]
    beside += compare.published_differences("error", on_training, published)
    released = published["released_clips"]
    for name, of in found.items():
        row = {"configuration": name, "source": "release"}
        for clip in (clip for clip in of["clips"] if clip["clip"] in released):
            what, mine = f"relative error, {clip['clip']}", clip.get("as_published", clip)["mean"]
            beside.append(compare.published_row(what, row, released[clip["clip"]], mine))
    return compare.ComparisonAddition(
        entries=[
            {**of, "rollouts": [{k: v for k, v in r.items() if k != "clips"} for r in of["rollouts"]]}
            | {"configuration": name}
            for name, of in found.items()
        ],
        about={name: {"joints": of["joints"]} for name, of in found.items()},
        differences=differences,
        against_published=beside,
    )


def tables(compared: Json) -> dict[str, list[Row]]:
    """Two tables, for every configuration: the errors of every clip; those of roll-outs of each length."""
    rolled: list[Row] = [
        {"configuration": entry["configuration"], "length": of["length"], "split": split, **of[split]}
        for entry in compared["accuracy"]
        for of in entry["rollouts"]
        for split in SPLITS
    ]
    clips = measure.flat_rows(compared["accuracy"], "clips", "configuration")
    return {"accuracy": clips, "rollouts": rolled}


def clip_means(found: Json, split: str) -> list[float]:
    """The mean error of each clip of a split that has one, as published ones were measured if possible."""
    clips = [c for c in found["clips"] if c["split"] == split and c["mean"] is not None]
    return [c.get("as_published", c)["mean"] for c in clips]


def compared_section(compared: Compared) -> PageSection:
    """The spread of the errors, those of roll-outs, and errors of single clips."""
    charts = error_boxes(compared), compared_roll_outs(compared), clip_lines(compared)
    shown = [SectionPart(10 * place, each) for place, each in enumerate(charts, 1)]
    return PageSection("accuracy", shown, title="Accuracy", order=10)


def compared_values(compared: Compared) -> Iterator[parts.ComparedValue]:
    """The error on each split, in roll-outs of about a second, and the number of measured joints.

    Of the roll-outs it is that on held-out clips, or on training clips if there are no held-out ones.
    """
    entries = {entry["configuration"]: entry for entry in compared["accuracy"]}
    for order, split, label in ((10, "held_out", "held-out error"), (20, "train", "training error")):
        values = {name: entry[split]["mean"] for name, entry in entries.items()}
        column = parts.Column(label, lambda value: f"{100 * value:.2f} %", "n")
        yield parts.ComparedValue(order, column, values)
    joints = {name: entry["joints"] for name, entry in entries.items()}
    yield parts.ComparedValue(70, parts.Column.count("joints"), joints)
    rolled = {name: {of["length"]: of for of in e["rollouts"]} for name, e in entries.items()}
    lengths = {length for of in rolled.values() for length in of}
    length = min(lengths, key=lambda n: abs(n - FRAMES_PER_SECOND), default=0)
    for split, label in SPLIT_LABELS.items():
        errors = {
            name: of.get(length, {}).get(split, {}).get("position_error_cm") for name, of in rolled.items()
        }
        if any(value is not None for value in errors.values()):
            of_what = f"in roll-outs of {length} frames on {label}"
            far = "the joints of {name} are {value} cm from the captured joints on average, " + of_what
            column = parts.Column.number("roll-out error, cm")
            yield parts.ComparedValue(25, column, errors, "Closest to captured motion", far)
            return


def error_boxes(compared: Compared) -> Chart:
    """A box for each configuration, over the mean errors of its clips, and published ones beside ours.

    A menu selects the split. Diamonds are published means over all clips.
    """
    names, options = parts.configuration_names(compared), {}
    published = {row["configuration"]: 100 * row["mean"] for row in compared["published"]["accuracy"]}
    known = [name for name in names if name in published]
    diamond = {"symbol": "diamond-open", "size": 10, "color": "@ink"}
    hover = "%{x}: %{y:.2f} % published<extra></extra>"
    means = [published[name] for name in known]
    marks = parts.marker_trace("published mean", known, means, diamond, hovertemplate=hover)
    for split, label in SPLIT_LABELS.items():
        of_split = {entry["configuration"]: clip_means(entry, split) for entry in compared["accuracy"]}
        if any(of_split.values()):
            ours, theirs = (
                {name: [100 * value for value in values] for name, values in each.items()}
                for each in (of_split, compared["published"]["clip_means"])
            )
            options[label] = ours_and_published(names, ours, theirs) + [marks] * bool(known)
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


def roll_out_chart(found: Json) -> Chart:
    """How the error grows in roll-outs, with a line for each split."""
    entries = found["rollouts"]
    traces = [t for split, name in NAMES.items() for t in _error_line(name, entries, split, COLOURS[split])]
    return parts.chart("rollouts", traces, _length_axes(traces), sample=measure.sample_sentence(found))


def compared_roll_outs(compared: Compared) -> Chart:
    """How the error grows when the networks continue from their own poses."""
    options: dict[str, list[Trace]] = {}
    colours = parts.configuration_colours(compared)
    for (split, label), entry in product(SPLIT_LABELS.items(), compared["accuracy"]):
        name = entry["configuration"]
        if line := _error_line(name, entry["rollouts"], split, colours[name]):
            options[label] = options.get(label, []) + line
    layout = _length_axes(trace for traces in options.values() for trace in traces)
    return parts.chart("compare-rollouts", layout=layout, choose="Clips", options=options, sample="")


def _error_line(name: str, entries: Iterable[Json], split: str, colour: str) -> list[Trace]:
    """The line of the mean error of a split over the length of roll-outs; [] if none was measured.

    entries: one for each length. If only a sample was measured, bars show 95 % confidence intervals.
    """
    known = [entry for entry in entries if (entry.get(split) or {}).get("position_error_cm") is not None]
    if not known:
        return []
    x, y = [entry["length"] for entry in known], [entry[split]["position_error_cm"] for entry in known]
    style: dict[str, Any] = {"mode": "lines+markers"}
    if widths := [e[split]["interval"]["position_error_cm"] for e in known if "interval" in e[split]]:
        style["error_y"] = {"type": "data", "array": widths, "color": "@faint", "thickness": 1}
    return [parts.line_trace(name, x, y, colour, **style)]


def _length_axes(traces: Iterable[Trace]) -> dict[str, Any]:
    frames = parts.log_axis("frames", [x for trace in traces for x in trace["x"]])
    return {"xaxis": frames, "yaxis": parts.axis("cm per joint", rangemode="tozero")}
