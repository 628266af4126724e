"""The fenced blocks of README and of the documentation."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

PAGES = ("README.md", "CONTRIBUTING.md", "data/README.md", "docs/*.md")
# `<!-- not run: why -->` stands before a block that needs what a test cannot have, such as a cluster.
BLOCK = re.compile(r"(<!-- not run: .+ -->\n+)?^```(\w+)\n(.*?)^```$", re.M | re.S)


class Block(NamedTuple):
    """page: its file. above: the text before it. text: what it says. run: whether tests run it."""

    page: str
    above: str
    text: str
    run: bool


def blocks(root: Path, language: str) -> Iterator[Block]:
    """The blocks of a language in all pages, in the order of the pages."""
    for pattern in PAGES:
        for path in sorted(root.glob(pattern)):
            text = path.read_text(encoding="utf-8")
            for found in BLOCK.finditer(text):
                if found[2] == language:
                    page = str(path.relative_to(root))
                    yield Block(page, text[: found.start()], found[3], found[1] is None)
