"""Renders the page that compares configurations into one self-contained HTML file."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from hobble.figure.pack import packed_body
from hobble.report import parts
from hobble.report.character import body_channel, skeleton_of
from hobble.report.sections import own_section, passes_axis, published_curve, stage_charts
from hobble.report.templates import compressed, render_page

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
        parts.join_sections([*shown["compared_section"], *own_sections(compared)]),
        {
            "playable": on_page,
            # Configurations with the same skeleton share a body. Its key is in the entry `body`.
            "bodies": {spec["body"]: packed_body(skeleton_of(spec)) for spec in on_page.values()},
        },
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


def own_sections(compared: parts.Compared) -> Iterator[parts.PageSection]:
    """The sections of a comparison that no measurement has."""
    colours = parts.configuration_colours(compared)
    stages = {
        name: [stage for stage in compared["stages"] if stage["configuration"] == name] for name in colours
    }
    costs = stage_charts(stages, "compare", parts.words("stages.once"), colours)
    read = parts.Paragraph(parts.words("published.read"))
    yield own_section("training", training_curves(compared))
    yield own_section("costs", parts.ChartGroup(costs))
    yield own_section("published", read, published_table(compared), long=True)
    yield own_section("origin", parts.TemplatePart("origin.html.j2"))


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
            x = passes_axis(entry) if key == "pass" else entry.get(key, [])
            train, held_out = entry.get("train_mse", []), entry.get("held_out_mse", [])
            if any(v is not None for v in held_out):
                traces.append(parts.line_trace(f"{name}, held out", x, held_out, colours[name]))
                values += held_out
            traces.append(
                parts.line_trace(f"{name}, training", x, train, colours[name], width=1.2, dash="dot")
            )
            values += train
            passes, published = published_curve(compared["published"], name)
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

    channel_names = {name: ", ".join(channels) or "none" for name, channels in by_name("channels").items()}
    values = [
        *measured,
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
