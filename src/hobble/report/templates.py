"""What all pages share: templates that escape values, the style sheet, and what measurements show in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
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
    PageSection,
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
    return join_sections(_of_each(material, "section"))


def measured_figures(material: ReportMaterial) -> list[KeyFigure]:
    """The key figures that measurements have for the top of the report."""
    return [figure for shown in _of_each(material, "figures") for figure in shown]


def measured_hints(material: ReportMaterial) -> list[Hint]:
    """The advice that follows from the numbers of the measurements."""
    return [hint for shown in _of_each(material, "hints") for hint in shown]


def _of_each(material: ReportMaterial, name: str) -> Iterator[Any]:
    """What the function `name` of each measurement returns."""
    for measure in material.measures:
        if (show := measure.function(name)) is not None:
            yield show(material.results_of(measure.name), material)


def compared_by(measures: Iterable[Any], name: str, compared: Json) -> list[Any]:
    """What the function `name` of each measurement returns for compare.json.

    measures: of the type `hobble.measures.measure.Measure`, which says what functions there are.
    """
    return [show(compared) for measure in measures if (show := measure.function(name)) is not None]
