"""Turns numbers into text for readers, and encodes data safely for a page."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
from markupsafe import Markup


def format_duration(seconds: float | None) -> str:
    """A time as text in a suitable unit; a dash for None.

    >>> [format_duration(seconds) for seconds in (0.42, 59.4, 59.6, 93, 5400, 154800, None)]
    ['0.42 s', '59 s', '1 min', '1 min 33 s', '1 h 30 min', '43 h', '–']
    """
    if seconds is None:
        return "–"
    if round(seconds) < 60:
        return f"{seconds:.2g} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes, more_seconds = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {more_seconds} s" if more_seconds else f"{minutes} min"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if minutes and hours < 24 else f"{hours} h"


def format_bytes(count: float | None) -> str:
    """A number of bytes as text, in B, kB, MB or GB (powers of 1000); a dash for None.

    >>> [format_bytes(count) for count in (512, 606e6, 999_600, 7_120_000_000, 1.2345e12, None)]
    ['512 B', '606 MB', '1 MB', '7.12 GB', '1,234 GB', '–']
    """
    if count is None:
        return "–"
    for unit in ("B", "kB", "MB", "GB"):
        text = f"{count:.0f}" if unit == "B" else f"{count:.3g}"
        if float(text) < 1000:  # rounding may have made it 1000
            return f"{text} {unit}"
        count /= 1000
    return f"{1000 * count:,.0f} GB"


def format_number(value: float | None, digits: int = 3) -> str:
    """A number as text with `digits` significant digits; a dash for None, NaN and infinity.

    Digits before the decimal point are all shown, with separators of thousands.

    >>> format_number(20000, 5)
    '20,000'
    >>> [format_number(value) for value in (0.04391, 1234.5, None, float("nan"), 0)]
    ['0.0439', '1,234', '–', '–', '0']
    """
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:,.{places}f}"


def json_data(value: Any) -> Any:
    """`value` as plain JSON data: tuples and arrays become lists, NaN and infinities become None."""
    if isinstance(value, dict):
        return {str(key): json_data(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [json_data(item) for item in value]
    if isinstance(value, np.ndarray):
        return json_data(value.tolist())
    if isinstance(value, np.generic):
        return json_data(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def embedded(value: Any) -> Markup:
    """JSON that is safe inside a <script> element, whatever its strings contain.

    "<", ">" and "&" are written as escapes, so that no string can end the element or open a comment.

    >>> embedded({"clip": "</script><b>"})
    Markup('{"clip":"\\\\u003c/script\\\\u003e\\\\u003cb\\\\u003e"}')
    """
    text = json.dumps(json_data(value), separators=(",", ":"), allow_nan=False, ensure_ascii=True)
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))
