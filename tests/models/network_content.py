"""The content of a network's file, and changes that make it malformed."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from hobble.core.skeleton import Skeleton
from hobble.rows.layout import CONTACTS, GAITS, RowLayout

Content = dict[str, Any]


Change = Callable[[Content], None]


def content(skeleton: Skeleton, links: int = 30) -> Content:
    """The arrays and the meta (as a mapping) of a valid file."""
    layout = RowLayout(len(skeleton.joints), channels=(("injury", links),) if links else ())
    rng = np.random.default_rng(1)
    sizes = (layout.x_size, 6, 5, layout.y_size)
    arrays: Content = {}
    for i, (a, b) in enumerate(pairwise(sizes)):
        arrays[f"W{i}"] = rng.normal(0, a**-0.5, (4, b, a)).astype(np.float32)
        arrays[f"b{i}"] = rng.normal(0, 0.1, (4, b)).astype(np.float32)
    for name, size in (("X", layout.x_size), ("Y", layout.y_size)):
        arrays[f"{name}mean"] = rng.normal(0, 10, size).astype(np.float32)
        arrays[f"{name}std"] = rng.uniform(1, 5, size).astype(np.float32)
    arrays["meta"] = {
        "kind": "pfnn",
        "layout": layout.to_dict(),
        "channels": {"injury": list(skeleton.link_names[:links])} if links else {},
        "skeleton": skeleton.to_dict(),
        "gaits": list(GAITS),
        "contacts": list(CONTACTS),
        "terrain_side": 25.0,
    }
    return arrays


def meta(**changes: Any) -> Change:
    return lambda c: c["meta"].update(changes)


def layout(**changes: Any) -> Change:
    return lambda c: c["meta"]["layout"].update(changes)


def skeleton(**changes: Any) -> Change:
    return lambda c: c["meta"]["skeleton"].update(changes)


def joint(name: str, **changes: Any) -> Change:
    return lambda c: c["meta"]["skeleton"]["joints"][name].update(changes)


def put(name: str, at: Any, value: float) -> Change:
    return lambda c: c[name].__setitem__(at, value)


def array(**changes: Any) -> Change:
    return lambda c: c.update(changes)


def text(value: Any) -> Change:
    return lambda c: c.update(meta=np.array(value))


def no(name: str) -> Change:
    return lambda c: c.pop(name)


def cut(name: str, axis: int) -> Change:
    return lambda c: c.update({name: np.delete(c[name], 0, axis)})


def no_role(name: str) -> Change:
    return lambda c: c["meta"]["skeleton"]["roles"].pop(name)


def each(*names: str, factor: float) -> Change:
    return lambda c: c.update({name: c[name] * np.float32(factor) for name in names})
