"""Renders the page that compares configurations into one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hobble.figure.pack import packed_body
from hobble.report import compare_sections as parts
from hobble.report import compare_tables as tables
from hobble.report import comparison_charts, measure_sections
from hobble.report.formats import embedded
from hobble.report.hero import body_channel
from hobble.report.playable import skeleton_of
from hobble.report.provenance import commit, machine, versions
from hobble.report.rounded_weights import has_weights, round_weights
from hobble.report.templates import FOLDER, mark_safe, specs, style, template

LARGEST_PAGE = 19_850_000  # bytes; the page must stay under 20 MB
RESERVED = 60_000  # bytes that are kept free for the page's text, style and tables
NAME = "compare"  # the page's name


def render_compared(
    compared: Mapping[str, Any],
    playables: Mapping[str, Mapping[str, Any]] | None = None,
    bundle: str = "",
    errors: Mapping[str, float] | None = None,
) -> str:
    """The comparison as one HTML document.

    compared: the content of compare.json. playables: configuration -> data of its character, from `playable`
    in `hobble.report.playable`. If these characters do not all fit into the page, their weights are rounded
    to 8 bits. Characters that still do not fit are left out. bundle: the page's scripts in one. errors:
    configuration -> mean distance in cm by which rounding the weights moves a predicted joint.
    """
    errors = errors or {}
    sections: dict[str, dict[str, Any]] = {
        "overview": {
            "verdicts": measure_sections.compared_verdicts(compared),
            "table": tables.configuration_table(compared),
            "published": tables.published_table(compared),
        },
        "training": {"curves": parts.training_curves(compared)},
        "stages": {"charts": parts.stage_dots(compared)},
    }
    shown, names = measure_sections.compared_sections(compared), comparison_charts.names(compared)
    charts = specs([sections, shown])
    bodies = {spec["body"]: packed_body(skeleton_of(spec)) for spec in (playables or {}).values()}
    used = len(bundle.encode()) + len(embedded(charts).encode()) + len(embedded(bodies).encode())
    kept, left_out = fitting(playables or {}, LARGEST_PAGE - RESERVED - used)
    rounded_names: list[str] = []
    if left_out:
        rounded_names = [name for name, spec in (playables or {}).items() if has_weights(spec)]
        smaller = {name: round_weights(spec) for name, spec in (playables or {}).items()}
        kept, left_out = fitting(smaller, LARGEST_PAGE - RESERVED - used)
    bodies = {spec["body"]: bodies[spec["body"]] for spec in kept.values()}
    data = {"name": NAME, "charts": charts, "playable": kept, "bodies": bodies}
    return template("compare.html.j2").render(
        name=NAME,
        measured=shown,
        title=" and ".join(names) if len(names) < 3 else f"{len(names)} configurations",
        eyebrow="Hobble report · comparison of configurations",
        lead="The same measurements of " + ", ".join(names) + ", compared with published results.",
        embedded={name: embedded(part) for name, part in data.items()},
        playable=list(kept),
        left_out=left_out,
        rounding=[(name, errors[name]) for name in rounded_names if name in kept and name in errors],
        hurts=any(body_channel(spec) for spec in kept.values()),
        style=style(),
        bundle=mark_safe("the bundle", bundle),
        provenance={"commit": commit(FOLDER), "machine": machine(), "versions": versions()},
        **sections,
    )


def fitting(
    playables: Mapping[str, Mapping[str, Any]], largest: int
) -> tuple[dict[str, Mapping[str, Any]], list[str]]:
    """The characters that fit into `largest` bytes together, in order, and the names of the others.

    If one does not fit, a smaller one after it still may.

    >>> fitting({"a": {"x": 1}, "b": {"x": "long" * 9}, "c": {"x": 2}}, 20)
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
