"""Renders the report of a configuration, or the comparison of several, into one self-contained HTML file."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import yaml

from hobble.core.quat import Array
from hobble.report import parts
from hobble.report import sections as own
from hobble.report.character import body_channel, opening_channel, opening_slider
from hobble.report.gather import ReportMaterial
from hobble.report.templates import compressed, measured_by, render_page

# Degrees a second: slower turning is not counted, because the body sways that much in a straight walk.
TURNING = 40.0
LITTLE_TURNING = 0.01  # if turning takes less than this share of the time, the page warns
LITTLE_OF_A_GAIT = 0.03  # the same for each gait
KIND_ORDER = ("warn", "note", "good", "fact")  # kinds of hints, in the order of the page


def render_report(
    material: ReportMaterial,
    playable: Mapping[str, Any] | None = None,
    captured_and_predicted: Mapping[str, Any] | None = None,
    bundle: str = "",
) -> str:
    """The report as one HTML document.

    playable: from `character.playable_data` or `character.playable_with_recogniser`. captured_and_predicted:
    from `character.packed_comparisons`. bundle: the page's scripts, from `bundle.bundle_page_scripts`.
    A section without data is left out.
    """
    # Seconds of data at each speed, turning speed and channel value.
    counted = own.seconds_of_data(material.row_files, material.splits)
    playable, compared = playable or {}, captured_and_predicted or {}
    opening = opening_slider(playable, material.measurements.values())
    on_page = {material.name: playable} if playable else {}
    return render_page(
        material.name,
        [parts.SectionPart(0, parts.KeyFigures(key_figures(material)))],
        parts.join_sections([*measured_by(material, "section"), *own.own_sections(material, counted)]),
        {"hero": opening, "playable": on_page, "compare": compared},
        bundle,
        dataset=material.dataset,
        title=material.title or material.name,
        headline=material.title,
        eyebrow=f"Hobble report · configuration {material.name} · data set {material.dataset}",
        lead=lead_text(material),
        opening=opening,
        hurts=body_channel(playable) is not None,  # whether the reader can hurt parts of the body
        shown_channel=opening_channel(playable),
        hints=hints(material, counted["both"]),
        playable=list(on_page),
        captured_and_predicted=[clip["name"] for clip in compared.get("clips", ())],
        configuration=yaml.safe_dump(dict(material.resolved), sort_keys=False, allow_unicode=True),
    )


def _training_options(material: ReportMaterial) -> Mapping[str, Any]:
    """The options of training in the configuration; empty if they are not known."""
    return (material.resolved.get("configuration") or {}).get("training") or {}


def _held_out_count(material: ReportMaterial) -> int:
    return sum(material.split_of(report["clip"]) == "held_out" for report in material.motion)


def lead_text(material: ReportMaterial) -> str:
    """A sentence or two on the network and its training data."""
    network, held_out, count = material.network, _held_out_count(material), len(material.motion)
    text = f"A character driven by {network['described']}, built"
    if network["sizes"]:
        columns = f"{network['inputs']} inputs and {network['outputs']} outputs"
        text = f"A {network['described']}, with {columns}, trained"
        passes = _training_options(material).get("passes")
        text += f" for {passes:g} passes" if passes else ""
    text += f" on {count - held_out} clips of the data set {material.dataset}"
    text += f", and tested on {held_out} held-out clips" if held_out else ""
    frames = sum(report.get("frames", 0) for report in material.motion)
    return f"{text}. All clips together have {frames:,} frames at 60\u00a0Hz."


def key_figures(material: ReportMaterial) -> list[parts.KeyFigure]:
    """The numbers at the top of the page, most important first."""
    figures = [figure for shown in measured_by(material, "figures") for figure in shown]
    seconds = sum(report.get("seconds", 0) for report in material.motion)
    if seconds:
        note = f"{len(material.motion)} clips, {_held_out_count(material)} of them held out"
        value, _, unit = parts.format_duration(seconds).partition(" ")
        figures.append(parts.KeyFigure("Motion data", value, unit, note, order=30))
    network, note = material.network, "numbers in its tables"
    # A PFNN has a set of weights at each control point, and `parameters` counts one of these sets. For other
    # networks it counts all parameters. Motion matching has no layers, so its `sizes` are empty.
    if network["sizes"]:
        which = " at each control point" if "control points" in network["described"] else ""
        note = f"parameters{which}; layers of {'–'.join(map(str, network['sizes']))}"
    note += f"; {parts.format_bytes(network['bytes'])} on disk"
    millions = parts.format_number(network["parameters"] / 1e6)
    figures.append(parts.KeyFigure("Network", millions, "M", note, order=40))
    if total := material.pipeline.get("total_seconds"):
        value, _, unit = parts.format_duration(total).partition(" ")
        note = (
            "sum over all jobs, from clips to measurements; jobs can run in parallel, so the run can be "
            f"shorter; {parts.format_bytes(material.pipeline.get('total_bytes'))} written"
        )
        figures.append(parts.KeyFigure("Whole pipeline", value, unit, note, order=50))
    return sorted(figures, key=lambda figure: figure.order)


def hints(material: ReportMaterial, both: Mapping[str, Array] | None = None) -> list[parts.Hint]:
    """Warnings and advice in the order in which to follow them, then what is good, then plain facts.

    both: of `sections.seconds_of_data`, if the seconds were counted.
    """
    found = [
        *(each for shown in measured_by(material, "hints") for each in shown),
        *_training_hints(material),
        *_gait_hints(material),
        *_turning_hints(both or {}),
        *_repair_hints(material),
    ]
    return sorted(found, key=lambda each: (KIND_ORDER.index(each.kind), each.order))


def _training_hints(material: ReportMaterial) -> Iterator[parts.Hint]:
    """Whether the held-out error rises, still falls, or has stopped falling."""
    curve = zip(material.history.get("pass", ()), material.history.get("held_out_mse", ()), strict=False)
    points = [(p, error) for p, error in curve if p is not None and error is not None]
    if len(points) < 8:  # with fewer values, a trend is only noise
        return
    passes, errors = np.array(points).T
    # The error is measured several times in a pass. One value is noisy, so compare means over passes.
    means = {p: errors[passes == p].mean() for p in dict.fromkeys(passes)}
    best = min(means, key=lambda p: means[p])
    if means[passes[-1]] > 1.05 * means[best]:
        yield parts.hint("hints.lowest", best=f"{best:.0f}")
    # With another schedule, the error fell because the learning rate fell. That does not show whether more
    # passes would help.
    elif _training_options(material).get("schedule", "constant") == "constant":
        quarter = max(1, len(errors) // 4)
        fall = 1 - errors[-quarter:].mean() / errors[-2 * quarter : -quarter].mean()
        yield (
            parts.hint("hints.falling", percent=f"{100 * fall:.0f}")
            if fall > 0.03
            else parts.hint("hints.flat")
        )


def _gait_hints(material: ReportMaterial) -> Iterator[parts.Hint]:
    """Gaits of which there is little data or none."""
    train, held_out = own.gait_seconds(material).values()
    totals = {gait: train[gait] + held_out[gait] for gait in train}
    little = LITTLE_OF_A_GAIT * sum(totals.values())
    if little and not totals["stand"]:
        yield parts.hint("hints.standing")
    scarce = sorted(g for g, seconds in totals.items() if 0 < seconds < little and g not in ("jump", "bump"))
    if scarce:
        yield parts.hint("hints.scarce", gaits=" and ".join(scarce), each=" each" if len(scarce) > 1 else "")


def _turning_hints(both: Mapping[str, Array]) -> Iterator[parts.Hint]:
    """A warning if hardly anybody turns. both: of `sections.seconds_of_data`."""
    seconds = np.sum([of_split.sum(axis=1) for of_split in both.values()], axis=0)
    if not np.any(seconds):
        return
    middles = (own.TURN_EDGES[:-1] + own.TURN_EDGES[1:]) / 2  # of the bins, degrees a second
    share = float(np.sum(seconds[np.abs(middles) > TURNING]) / np.sum(seconds))
    if share < LITTLE_TURNING:
        yield parts.hint("hints.turning", percent=f"{100 * share:.1f}", turning=f"{TURNING:.0f}")


def _repair_hints(material: ReportMaterial) -> Iterator[parts.Hint]:
    """How many clips were repaired or have warnings."""
    reports = [*material.labels, *material.channels]
    repaired = {report["clip"] for report in material.motion if report.get("repairs")}
    warned = {report["clip"] for report in reports if report.get("warnings")}
    if repaired or warned:
        yield parts.hint("hints.repaired", repaired=len(repaired), warned=len(warned))


# The page that compares configurations.

# Bytes of the characters in a page together, at most; with scripts and charts it stays under 20 MB.
LARGEST_CHARACTERS = 14_000_000


def render_comparison(
    compared: Mapping[str, Any],
    playables: Mapping[str, Mapping[str, Any]] | None = None,
    bundle: str = "",
    measures: Sequence[Any] = (),
) -> str:
    """The comparison as one HTML document.

    compared: the content of compare.json. playables: configuration -> data of a character that its network
    moves in the page, from `playable_data` in `hobble.report.character`. Characters that do not fit into
    the page are left out. bundle: all scripts of the page as one script. measures: all measurements, for what
    they show.
    """
    shown = {
        name: [show(compared) for measure in measures if (show := measure.function(name)) is not None]
        for name in ("compared_values", "compared_section")
    }
    values = sorted((v for each in shown["compared_values"] for v in each), key=lambda value: value.order)
    names, on_page, left_out, used = parts.configuration_names(compared), {}, [], 0
    for name, spec in (playables or {}).items():
        size = len(compressed(spec))
        if spec and used + size <= LARGEST_CHARACTERS:
            used, on_page[name] = used + size, spec
        elif spec:
            left_out.append(name)
    return render_page(
        "compare",
        [parts.SectionPart(0, configuration_table(compared, values), open=True)],
        parts.join_sections([*shown["compared_section"], *compared_sections(compared)]),
        {"playable": on_page},
        bundle,
        title=" and ".join(names) if len(names) < 3 else f"{len(names)} configurations",
        eyebrow="Hobble report · comparison of configurations",
        lead="The same measurements of " + ", ".join(names) + ", compared with published results.",
        opening=None,
        hints=[value.verdict for value in values if value.verdict],
        playable=list(on_page),
        left_out=left_out,
        hurts=any(body_channel(spec) for spec in on_page.values()),
    )


def compared_sections(compared: parts.Compared) -> Iterator[parts.PageSection]:
    """The sections of a comparison that no measurement has."""
    colours = parts.configuration_colours(compared)
    stages = {
        name: [stage for stage in compared["stages"] if stage["configuration"] == name] for name in colours
    }
    costs = own.stage_charts(stages, "compare", parts.words("stages.once"), colours)
    read = parts.Paragraph(parts.words("published.read"))
    yield own.own_section("training", training_curves(compared))
    yield own.own_section("costs", parts.ChartGroup(costs))
    yield own.own_section("published", read, published_table(compared))
    yield own.own_section("origin", parts.TemplatePart("origin.html.j2"))


# Column of a configuration's training history -> title of the horizontal axis.
X_AXES = {"pass": "passes", "seconds": "seconds of training", "samples": "samples seen"}


def training_curves(compared: parts.Compared) -> parts.Chart | None:
    """Training and held-out error of all configurations. A menu selects the horizontal axis, see X_AXES."""
    options: dict[str, list[parts.Trace]] = {}
    values: list[float | None] = []
    colours = parts.configuration_colours(compared)
    for key, label in X_AXES.items():
        for entry in compared["training"]:
            name, traces = entry["configuration"], options.setdefault(label, [])
            x = own.passes_axis(entry) if key == "pass" else entry.get(key, [])
            train, held_out = entry.get("train_mse", []), entry.get("held_out_mse", [])
            if any(v is not None for v in held_out):
                traces.append(parts.line_trace(f"{name}, held out", x, held_out, colours[name]))
                values += held_out
            traces.append(
                parts.line_trace(f"{name}, training", x, train, colours[name], width=1.2, dash="dot")
            )
            values += train
            passes, published = own.published_curve(compared["published"], name)
            if key == "pass" and passes:
                whose = f"{name}, published"
                traces.append(
                    parts.line_trace(whose, passes, published, colours[name], width=1.2, dash="dashdot")
                )
                values += published
    if not options:
        return None
    return parts.chart(
        "compare-training",
        layout={"yaxis": parts.log_axis("mean squared error", values)},
        height=420,
        choose="Horizontal axis",
        options=options,
        option_layouts={label: {"xaxis": {**parts.axis(label), "rangemode": "tozero"}} for label in options},
    )


def configuration_table(compared: parts.Compared, measured: Sequence[parts.ComparedValue]) -> parts.Table:
    """A column for each configuration, with its settings and the values `measured`."""
    entries = {entry["configuration"]: entry for entry in compared["configurations"]}

    def by_name(key: str) -> dict[str, Any]:
        """Configuration -> its entry `key` in compare.json."""
        return {name: entry[key] for name, entry in entries.items()}

    trained = {s["configuration"]: s["seconds"] for s in compared["stages"] if s["stage"] == "training"}
    channel_names = {name: ", ".join(channels) or "none" for name, channels in by_name("channels").items()}
    values = [
        *measured,
        parts.ComparedValue(45, parts.Column.number("seconds to train"), trained),
        parts.ComparedValue(50, parts.Column("channels"), channel_names),
        parts.ComparedValue(60, parts.Column("data set"), by_name("dataset")),
        parts.ComparedValue(80, parts.Column.count("layers"), by_name("hidden_layers")),
        parts.ComparedValue(90, parts.Column.count("units"), by_name("units")),
        parts.ComparedValue(100, parts.Column.number("passes"), by_name("passes")),
    ]
    rows = [
        [value.column.label, *(value.shown(name) for name in entries)]
        for value in sorted(values, key=lambda value: value.order)
    ]
    heads = [parts.Column("value"), *(parts.Column(name, kind="n") for name in entries)]
    return parts.Table("compare-configurations", heads, rows, "The configurations", first=len(rows))


def published_table(compared: parts.Compared) -> parts.Table:
    """The published results next to ours. Results that we did not measure come last."""
    sources, longer = compared["published"]["sources"], parts.told("published.longer")
    formats = {"bytes": parts.format_bytes, "s": parts.format_duration}

    def as_text(value: float | None, unit: str) -> str:
        if value is None or unit in formats:
            return "" if value is None else formats[unit](float(value))
        return f"{parts.format_number(float(value), 3)} {unit}".strip()

    published = (*compared["against_published"], *compared["milliseconds"]["against_published"])
    records = [
        {
            "measure": longer.get(row["measure"], row["measure"]),
            "configuration": row["configuration"],
            **{key: as_text(row[key], row["unit"]) for key in ("published", "ours")},
            "source": parts.citation(row, sources),
        }
        for row in sorted(published, key=lambda row: row["ours"] is None)
    ]
    return parts.table("compare-published", records, title=parts.words("sections.published.title"))
