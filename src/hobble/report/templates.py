"""What all pages share: templates that escape values, the style sheet, scripts, and the data of charts."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template, select_autoescape
from markupsafe import Markup

from hobble.report.charts import Chart, ChartGroup
from hobble.report.formats import format_bytes, format_duration, format_number
from hobble.report.page_parts import ChartPair, PageSection

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
