"""What all pages share: templates that escape values, the style sheet, and what measurements show in them."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template, select_autoescape
from markupsafe import Markup

from hobble.report.gather import ReportMaterial
from hobble.report.parts import (
    Chart,
    ChartGroup,
    ChartPair,
    Hint,
    KeyFigure,
    OverviewColumn,
    PageSection,
    Verdict,
    format_bytes,
    format_duration,
    format_number,
    join_sections,
)

Json = Mapping[str, Any]
FOLDER = Path(__file__).parent


def load_template(name: str) -> Template:
    """The template in the file `name`. It escapes every value, and a missing value is an error."""
    environment = Environment(
        loader=FileSystemLoader(FOLDER),
        autoescape=select_autoescape(default=True, default_for_string=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(duration=format_duration, size=format_bytes, number=format_number)
    return environment.get_template(name)


def chart_specs(shown: Any) -> dict[str, Any]:
    """Chart name -> the chart's data for the page's script.

    shown: a chart, section or other part of a page, or any nesting of lists and mappings of them.
    """
    if isinstance(shown, Chart):
        return {shown.name: shown.spec()}
    if isinstance(shown, ChartGroup | ChartPair):
        return chart_specs(shown.charts)
    if isinstance(shown, PageSection):
        return chart_specs([part.content for part in shown.parts])
    if isinstance(shown, Mapping):
        return chart_specs(list(shown.values()))
    if isinstance(shown, list | tuple):
        return {name: spec for item in shown for name, spec in chart_specs(item).items()}
    return {}


def page_style() -> Markup:
    """The pages' style sheet."""
    return mark_safe("page.css", (FOLDER / "page.css").read_text(encoding="utf-8"))


def questionnaire_script() -> Markup:
    """The script of the questionnaire. Unlike the pages' scripts, it is a single file without imports."""
    return mark_safe("questionnaire.js", (FOLDER / "questionnaire.js").read_text(encoding="utf-8"))


def mark_safe(name: str, text: str) -> Markup:
    """Mark our own CSS or script as safe, so that templates do not escape it. name: for the error message.

    Raises ValueError if the text contains the end tag of a <script> or <style> element.
    """
    if "</script" in text.lower() or "</style" in text.lower():
        raise ValueError(f"{name} contains </script or </style, which would end its element")
    return Markup(text)


def measured_sections(material: ReportMaterial) -> list[PageSection]:
    """The sections of the report that show measurements."""
    return join_sections(
        show(material.results_of(name), material) for name, show in _functions("page", "section")
    )


def measured_figures(material: ReportMaterial) -> list[KeyFigure]:
    """The key figures that measurements have for the top of the report."""
    return [
        f for name, show in _functions("page", "figures") for f in show(material.results_of(name), material)
    ]


def measured_hints(material: ReportMaterial) -> list[Hint]:
    """The advice that follows from the numbers of the measurements."""
    return [
        h for name, show in _functions("page", "hints") for h in show(material.results_of(name), material)
    ]


def compared_sections(compared: Json) -> list[PageSection]:
    """The sections of the comparison page that show measurements."""
    return join_sections(show(compared) for _, show in _functions("comparison_page", "section"))


def compared_verdicts(compared: Json) -> list[Verdict]:
    """Sentences on which configuration is best in some respect, in the order of the page."""
    verdicts = [
        verdict for _, show in _functions("comparison_page", "verdicts") for verdict in show(compared)
    ]
    return sorted(verdicts, key=lambda verdict: verdict.order)


def compared_columns(compared: Json) -> list[OverviewColumn]:
    """The columns that measurements add to the table of configurations. They are not sorted yet."""
    return [column for _, show in _functions("comparison_page", "columns") for column in show(compared)]


def _functions(module: str, name: str) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Find the function `name` in the modules of this name of all measurements.

    module: "page" or "comparison_page". Yields (name of the measurement, function). A measurement without
    the module or the function is left out.
    """
    # By name, because measurements import this package.
    for measure in importlib.import_module("hobble.measures.registry").MEASURES:
        if (function := getattr(measure.import_module(module), name, None)) is not None:
            yield measure.name, function
