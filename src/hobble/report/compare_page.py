"""Renders the page that compares configurations into one self-contained HTML file."""

from collections.abc import Mapping, Sequence
from typing import Any

from hobble.figure.pack import packed_body
from hobble.report import parts
from hobble.report.character import body_channel, skeleton_of
from hobble.report.sections import own_section, passes_axis, published_curve, stage_charts
from hobble.report.templates import compared_by, compressed, drawn_by_script, render_page

LARGEST_PAGE = 19_850_000  # bytes; the page must stay under 20 MB
RESERVED = 60_000  # bytes of LARGEST_PAGE that are kept free for the page's text, style and tables
NAME = "compare"  # the page's name


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
    values = [value for each in compared_by(measures, "compared_values", compared) for value in each]
    stages = {
        name: [stage for stage in compared["stages"] if stage["configuration"] == name]
        for name in parts.configuration_names(compared)
    }
    costs = stage_charts(stages, "compare", parts.words("stages.once"), parts.configuration_colours(compared))
    overview = parts.PageSection("summary", [parts.SectionPart(0, configuration_table(compared, values))])
    sections = parts.join_sections(
        [
            *compared_by(measures, "compared_section", compared),
            own_section("training", training_curves(compared)),
            own_section("costs", parts.ChartPair(costs)),
            own_section(
                "published",
                parts.Paragraph(parts.words("published.read")),
                published_table(compared),
                long=True,
            ),
            own_section("origin", parts.TemplatePart("origin.html.j2")),
        ]
    )
    playables = {name: spec for name, spec in (playables or {}).items() if spec}
    names = parts.configuration_names(compared)
    drawn = drawn_by_script([overview, *sections])
    # Configurations with the same skeleton share a body. Its key is in the entry `body` of a character.
    bodies = {spec["body"]: packed_body(skeleton_of(spec)) for spec in playables.values()}
    used = sum(map(len, (bundle.encode(), compressed(bodies), *map(compressed, drawn.values()))))
    on_page, left_out = select_fitting(playables, LARGEST_PAGE - RESERVED - used)
    bodies = {spec["body"]: bodies[spec["body"]] for spec in on_page.values()}
    return render_page(
        "compare.html.j2",
        {"name": NAME, **drawn, "playable": on_page, "bodies": bodies},
        bundle,
        name=NAME,
        sections=sections,
        overview=overview,
        verdicts=sorted((v for v in values if v.verdict), key=lambda value: value.order),
        title=" and ".join(names) if len(names) < 3 else f"{len(names)} configurations",
        eyebrow="Hobble report · comparison of configurations",
        lead="The same measurements of " + ", ".join(names) + ", compared with published results.",
        playable=list(on_page),
        left_out=left_out,
        hurts=any(body_channel(spec) for spec in on_page.values()),
    )


def select_fitting(
    playables: Mapping[str, Mapping[str, Any]], largest: int
) -> tuple[dict[str, Mapping[str, Any]], list[str]]:
    """The characters that fit into `largest` bytes together, and the names of those that are left out.

    Characters are taken in order. After one that does not fit, a smaller one may still fit.

    >>> select_fitting({"a": {"x": 1}, "b": {"x": "long" * 9}, "c": {"x": 2}}, 40)
    ({'a': {'x': 1}, 'c': {'x': 2}}, ['b'])
    """
    kept: dict[str, Mapping[str, Any]] = {}
    left_out, used = [], 0
    for name, spec in playables.items():
        needed = len(compressed(spec))
        if used + needed > largest:
            left_out.append(name)
        else:
            used += needed
            kept[name] = spec
    return kept, left_out


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
    """A row for each configuration: its settings, and the columns `measured` of its measurements."""
    entries = {entry["configuration"]: entry for entry in compared["configurations"]}

    def by_name(key: str) -> dict[str, Any]:
        """Configuration -> its entry `key` in compare.json."""
        return {name: entry[key] for name, entry in entries.items()}

    channel_names = {name: ", ".join(channels) or "none" for name, channels in by_name("channels").items()}
    columns = [
        *measured,
        parts.ComparedValue(50, parts.Column("channels"), channel_names),
        parts.ComparedValue(60, parts.Column("data set"), by_name("dataset")),
        parts.ComparedValue(80, parts.Column.count("layers"), by_name("hidden_layers")),
        parts.ComparedValue(90, parts.Column.count("units"), by_name("units")),
        parts.ComparedValue(100, parts.Column.number("passes"), by_name("passes")),
    ]
    columns.sort(key=lambda column: column.order)
    rows = [[name, *(column.values.get(name) for column in columns)] for name in entries]
    heads = [parts.Column("configuration"), *(column.column for column in columns)]
    return parts.Table("compare-configurations", heads, rows, "The configurations")


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
