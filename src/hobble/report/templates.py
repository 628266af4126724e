"""What all pages share: templates that escape values, the style sheet, and what measurements show in them."""

import base64
import hashlib
import re
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template, select_autoescape
from markupsafe import Markup, escape

from hobble.figure.pack import packed_body
from hobble.report.character import skeleton_of
from hobble.report.gather import ReportMaterial
from hobble.report.parts import Chart, PageSection, SectionPart, Table, embedded
from hobble.report.provenance import git_commit, machine, versions

FOLDER = Path(__file__).parent
AT_ONCE = ("name", "hero", "bodies", "playable")  # what the figures at the top need, before the page is read


def load_template(name: str) -> Template:
    """The template in the file `name`. It escapes every value, and a missing value is an error."""
    environment = Environment(
        loader=FileSystemLoader(FOLDER),
        autoescape=select_autoescape(default=True, default_for_string=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(hash_source=hash_source, code=with_code)
    return environment.get_template(name)


def with_code(text: str) -> Markup:
    """A text of which the parts between backticks are shown as code."""
    return Markup(re.sub("`([^`]*)`", r"<code>\1</code>", str(escape(text))))


def render_page(
    name: str,
    summary: Iterable[SectionPart],
    sections: Iterable[PageSection],
    for_scripts: Mapping[str, Any],
    bundle: str,
    **values: Any,
) -> str:
    """A page as one HTML document, with style, scripts and data inside.

    name: of the folder of results. summary: parts that are always open, before the sections. for_scripts:
    part -> JSON data for the scripts. bundle: all scripts as one script. values: the template's other values.

    Texts from the user's files cannot become HTML: the template escapes every value, and the data for the
    scripts is JSON without any "<". Parts that are not needed at once are compressed. The browser runs only
    scripts whose hash is in the page's policy.
    """
    summary, sections = list(summary), list(sections)
    parts = [*summary, *(part for section in sections for part in section.parts)]
    # Characters with the same skeleton share a body. Its key is in the entry `body`.
    bodies = {spec["body"]: packed_body(skeleton_of(spec)) for spec in for_scripts["playable"].values()}
    given = {"name": name, "bodies": bodies, **for_scripts, **drawn_by_script(parts)}
    at_once = AT_ONCE if "hero" in given else ()
    return load_template("page.html.j2").render(
        name=name,
        summary=summary,
        sections=sections,
        embedded={key: embedded(part) for key, part in given.items() if key in at_once},
        compressed={key: compressed(part) for key, part in given.items() if key not in at_once},
        style=own_file("page.css"),
        bundle=mark_safe("the bundle", bundle),
        policy=policy(bundle, own_file("page.css")),
        provenance={"commit": git_commit(FOLDER), "machine": machine(), "versions": versions()},
        **values,
    )


def drawn_by_script(parts: Iterable[SectionPart]) -> dict[str, dict[str, Any]]:
    """The data of charts and long tables for the page's script: {"charts": name -> data, "tables": ...}.

    The page itself has the first rows of a table.
    """
    found = [one for part in parts for one in getattr(part.content, "charts", [part.content])]
    tables = [one for one in found if isinstance(one, Table) and len(one.rows) > one.first]
    return {
        "charts": {one.name: one.spec() for one in found if isinstance(one, Chart)},
        "tables": {one.name: one.spec() for one in tables},
    }


def compressed(value: Any) -> str:
    """JSON, compressed (zlib) and in base64."""
    return base64.b64encode(zlib.compress(embedded(value).encode(), 9)).decode()


def policy(script: str, style: str) -> str:
    """The page's Content-Security-Policy: it fetches nothing, and has no other script and style than these.

    blob: is for plotly.js, which this script unpacks; wasm-unsafe-eval lets it compile WebAssembly. The empty
    style is that of plotly.js, which adds its rules one by one.
    """
    return (
        f"default-src 'none'; script-src {hash_source(script)} blob: 'wasm-unsafe-eval'; "
        f"style-src {hash_source(style)} {hash_source('')}; "
        "img-src data: blob:; media-src blob:; font-src data:"
    )


def hash_source(text: str) -> str:
    """What allows a script or a style in a Content-Security-Policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def own_file(name: str) -> Markup:
    """The style sheet of the pages, page.css, or the script of the questionnaire, a file without imports."""
    return mark_safe(name, (FOLDER / name).read_text(encoding="utf-8"))


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
