"""The pages of the documentation site that are other files of the checkout, and the loops of the gallery."""

import json
from pathlib import Path

from mkdocs.structure.files import File, Files

PAGES = {"index.md": "README.md", "clips.md": "data/README.md", "skeletons.md": "config/skeletons/README.md"}
LOOPS = "results/limp/stimuli"  # the rule `stimuli` makes this folder


def on_files(files: Files, config: dict) -> Files:
    """Add the pages and the loops; links between files of the checkout become links between pages."""
    root = Path(config["config_file_path"]).parent
    for page, file in PAGES.items():
        text = (root / file).read_text(encoding="utf-8").replace("(docs/", "(")
        files.append(File.generated(config, page, content=text))
    for path in sorted((root / LOOPS).glob("*.webp")):
        files.append(File.generated(config, f"pictures/limps/{path.name}", abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: object, config: dict, files: Files) -> str:
    """Add the loops to the gallery, each with what hurts in it."""
    listed = Path(config["config_file_path"]).parent / LOOPS / "stimuli.json"
    if page.file.src_uri != "gallery.md" or not listed.is_file():
        return markdown
    return f"{markdown}\n\n{gallery(json.loads(listed.read_text(encoding='utf-8'))['stimuli'])}"


def gallery(loops: list[dict]) -> str:
    """Markdown with each loop, its name, its values and its speed. loops: from stimuli.json."""
    parts = []
    for loop in loops:
        name = loop["name"].removeprefix("preset-").replace("-", " ")
        values = ", ".join(f"{column} {value:g}" for column, value in loop["values"].items())
        about = f"{values or 'nothing hurts'}; {loop['metres_a_second']:.2f} m/s"
        parts.append(f"## {name.capitalize()}\n\n![{name}](pictures/limps/{loop['name']}.webp)\n\n{about}.")
    return "\n\n".join(parts)
