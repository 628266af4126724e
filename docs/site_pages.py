"""The pages of the documentation site that are other files of the checkout: README.md and data/README.md."""

from __future__ import annotations

from pathlib import Path

from mkdocs.structure.files import File, Files

PAGES = {"index.md": "README.md", "clips.md": "data/README.md", "skeletons.md": "config/skeletons/README.md"}


def on_files(files: Files, config: dict) -> Files:
    """Add the pages; links between files of the checkout become links between pages."""
    root = Path(config["config_file_path"]).parent
    for page, file in PAGES.items():
        text = (root / file).read_text(encoding="utf-8").replace("(docs/", "(")
        files.append(File.generated(config, page, content=text))
    return files
