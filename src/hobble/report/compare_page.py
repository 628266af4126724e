"""Renders the page that compares configurations into one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hobble.figure.pack import packed_body
from hobble.report import compare_sections, compare_tables, comparison_charts, measure_sections
from hobble.report.formats import embedded
from hobble.report.opening_slider import body_channel
from hobble.report.playable import skeleton_of
from hobble.report.provenance import git_commit, machine, versions
from hobble.report.rounded_weights import has_weights, round_weights
from hobble.report.templates import FOLDER, chart_specs, load_template, mark_safe, page_style

LARGEST_PAGE = 19_850_000  # bytes; the page must stay under 20 MB
RESERVED = 60_000  # bytes of LARGEST_PAGE that are kept free for the page's text, style and tables
NAME = "compare"  # the page's name


def render_comparison(
    compared: Mapping[str, Any],
    playables: Mapping[str, Mapping[str, Any]] | None = None,
    bundle: str = "",
    errors: Mapping[str, float] | None = None,
) -> str:
    """The comparison as one HTML document.

    compared: the content of compare.json. playables: configuration -> data of a character that its network
    moves in the page, from `playable_data` in `hobble.report.playable`. If these characters do not all fit
    into the page, the weights of all of them are rounded to 8 bits. Characters that still do not fit are left
    out. bundle: all scripts of the page as one script. errors: configuration -> mean distance in cm by which
    rounding the weights moves a predicted joint.
    """
    errors = errors or {}
    sections: dict[str, dict[str, Any]] = {
        "overview": {
            "verdicts": measure_sections.compared_verdicts(compared),
            "table": compare_tables.configuration_table(compared),
            "published": compare_tables.published_table(compared),
        },
        "training": {"curves": compare_sections.training_curves(compared)},
        "stages": {"charts": compare_sections.stage_charts(compared)},
    }
    measured_sections = measure_sections.compared_sections(compared)
    names = comparison_charts.configuration_names(compared)
    charts = chart_specs([sections, measured_sections])
    # Configurations with the same skeleton share a body. Its key is in the entry `body` of a character.
    bodies = {spec["body"]: packed_body(skeleton_of(spec)) for spec in (playables or {}).values()}
    used = len(bundle.encode()) + len(embedded(charts).encode()) + len(embedded(bodies).encode())
    on_page, left_out = select_fitting(playables or {}, LARGEST_PAGE - RESERVED - used)
    rounded_names: list[str] = []
    if left_out:
        rounded_names = [name for name, spec in (playables or {}).items() if has_weights(spec)]
        smaller = {name: round_weights(spec) for name, spec in (playables or {}).items()}
        on_page, left_out = select_fitting(smaller, LARGEST_PAGE - RESERVED - used)
    bodies = {spec["body"]: bodies[spec["body"]] for spec in on_page.values()}
    data = {"name": NAME, "charts": charts, "playable": on_page, "bodies": bodies}
    return load_template("compare.html.j2").render(
        name=NAME,
        measured_sections=measured_sections,
        title=" and ".join(names) if len(names) < 3 else f"{len(names)} configurations",
        eyebrow="Hobble report · comparison of configurations",
        lead="The same measurements of " + ", ".join(names) + ", compared with published results.",
        embedded={name: embedded(part) for name, part in data.items()},
        playable=list(on_page),
        left_out=left_out,
        rounding=[(name, errors[name]) for name in rounded_names if name in on_page and name in errors],
        hurts=any(body_channel(spec) for spec in on_page.values()),
        style=page_style(),
        bundle=mark_safe("the bundle", bundle),
        provenance={"commit": git_commit(FOLDER), "machine": machine(), "versions": versions()},
        **sections,
    )


def select_fitting(
    playables: Mapping[str, Mapping[str, Any]], largest: int
) -> tuple[dict[str, Mapping[str, Any]], list[str]]:
    """The characters that fit into `largest` bytes together, and the names of those that are left out.

    Characters are taken in order. After one that does not fit, a smaller one may still fit.

    >>> select_fitting({"a": {"x": 1}, "b": {"x": "long" * 9}, "c": {"x": 2}}, 20)
    ({'a': {'x': 1}, 'c': {'x': 2}}, ['b'])
    """
    kept: dict[str, Mapping[str, Any]] = {}
    left_out, used = [], 0
    for name, spec in playables.items():
        needed = len(embedded(spec))
        if used + needed > largest:
            left_out.append(name)
        else:
            used += needed
            kept[name] = spec
    return kept, left_out
