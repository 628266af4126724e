"""What all pages share: templates that escape values, style, scripts, specifications of charts."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template, select_autoescape
from markupsafe import Markup

from hobble.report.charts import Chart, ChartGroup
from hobble.report.formats import duration, number, size
from hobble.report.page_parts import ChartPair, PageSection

FOLDER = Path(__file__).parent


def template(name: str) -> Template:
    """A template that escapes every value. A missing value is an error."""
    environment = Environment(
        loader=FileSystemLoader(FOLDER),
        autoescape=select_autoescape(default=True, default_for_string=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(duration=duration, size=size, number=number)
    return environment.get_template(name)


def specs(shown: Any) -> dict[str, Any]:
    """Chart name -> specification for the scripts, for all charts in nested sections and collections."""
    if isinstance(shown, Chart):
        return {shown.name: shown.spec()}
    if isinstance(shown, ChartGroup | ChartPair):
        return specs(shown.charts)
    if isinstance(shown, PageSection):
        return specs([part.content for part in shown.parts])
    if isinstance(shown, Mapping):
        return specs(list(shown.values()))
    if isinstance(shown, list | tuple):
        return {name: spec for item in shown for name, spec in specs(item).items()}
    return {}


def style() -> Markup:
    """The pages' style sheet."""
    return trusted("page.css", (FOLDER / "page.css").read_text(encoding="utf-8"))


def questionnaire_script() -> Markup:
    """The script of the questionnaire. It imports nothing."""
    return trusted("questionnaire.js", (FOLDER / "questionnaire.js").read_text(encoding="utf-8"))


def trusted(name: str, text: str) -> Markup:
    """Our own CSS or script, marked as safe. Raises ValueError if it contains the end tag of its element."""
    if "</script" in text.lower() or "</style" in text.lower():
        raise ValueError(f"{name} contains </script or </style, which would end its element")
    return Markup(text)
