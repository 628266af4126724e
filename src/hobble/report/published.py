"""Citations of published numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def cited(row: Mapping[str, Any], sources: Mapping[str, str]) -> str:
    """Source and table of a published number, and the other value if its publication gives two.

    row: an entry of `hobble/evaluation/published.yaml`. sources: key of a source -> its authors and year.

    >>> cited({"source": "a", "table": "5.2", "other_figure": "3 in Appendix A"}, {"a": "Author (2021)"})
    'Author (2021), Table 5.2 (but 3 in Appendix A)'
    >>> cited({"source": "a"}, {"a": "Author (2021)"})
    'Author (2021)'
    """
    text = sources.get(row["source"], row["source"])
    if row.get("table"):
        text += f", Table {row['table']}"
    return f"{text} (but {row['other_figure']})" if row.get("other_figure") else text
