"""Says where a published number is from, for the tables that compare it with ours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def citation(row: Mapping[str, Any], sources: Mapping[str, str]) -> str:
    """Source and table of a published number. If its publication also gives another value, this is added.

    row: the number's entry in `hobble/evaluation/published.yaml`. sources: key of a source -> its authors and
    year.

    >>> citation({"source": "a", "table": "5.2", "other_figure": "3 in Appendix A"}, {"a": "Author (2021)"})
    'Author (2021), Table 5.2 (but 3 in Appendix A)'
    >>> citation({"source": "a"}, {"a": "Author (2021)"})
    'Author (2021)'
    """
    text = sources.get(row["source"], row["source"])
    if row.get("table"):
        text += f", Table {row['table']}"
    return f"{text} (but {row['other_figure']})" if row.get("other_figure") else text
