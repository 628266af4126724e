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
    PageSection,
    embedded,
    format_bytes,
    format_duration,
    format_number,
)
from hobble.report.provenance import git_commit, machine, versions

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


def render_page(template: str, for_scripts: Mapping[str, Any], bundle: str, **values: Any) -> str:
    """A page as one HTML document, with style, scripts and data inside.

    template: its file. for_scripts: part -> JSON data for the scripts. bundle: all scripts as one script.
    values: the template's other values.

    Texts from the user's files cannot become HTML: the template escapes every value, and the data for the
    scripts is JSON without any "<".
    """
    return load_template(template).render(
        embedded={name: embedded(part) for name, part in for_scripts.items()},
        style=page_style(),
        bundle=mark_safe("the bundle", bundle),
        provenance={"commit": git_commit(FOLDER), "machine": machine(), "versions": versions()},
        **values,
    )


def chart_specs(shown: Any) -> dict[str, Any]:
    """Chart name -> the chart's data for the page's script.

    shown: a chart, section or other part of a page, or any nesting of lists and mappings of them.
    """
    if isinstance(shown, Chart):
        return {shown.name: shown.spec()}
    if isinstance(shown, PageSection):
        shown = [part.content for part in shown.parts]
    if isinstance(shown, Mapping):
        shown = list(shown.values())
    shown = getattr(shown, "charts", shown)  # of a group or a pair of charts
    if not isinstance(shown, list | tuple):
        return {}
    return {name: spec for item in shown for name, spec in chart_specs(item).items()}


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


def measured_by(material: ReportMaterial, name: str) -> Iterator[Any]:
    """What the function `name` of each measurement returns: its `section`, its `figures` or its `hints`."""
    for measure in material.measures:
        if (show := measure.function(name)) is not None:
            yield show(material.results_of(measure.name), material)


def compared_by(measures: Iterable[Any], name: str, compared: Mapping[str, Any]) -> list[Any]:
    """What the function `name` of each measurement returns for compare.json.

    measures: of the type `hobble.measures.measure.Measure`, which says what functions there are.
    """
    return [show(compared) for measure in measures if (show := measure.function(name)) is not None]
