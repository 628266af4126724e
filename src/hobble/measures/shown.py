"""Charts and tables of measurements, as parts of pages.

Titles and captions are in report/captions.yaml, each under the name of its chart.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hobble.channels.shown import shown_names
from hobble.core.files import Json
from hobble.core.quat import Array
from hobble.report.parts import Chart, Records, Trace, chart, line_trace, marker_trace

STRIP_WIDTH, STRIP_HEIGHT = 110.0, 205.0  # cm between the figures of a strip


def ours_and_published(
    names: Sequence[str],
    ours: Mapping[str, Sequence[float]],
    published: Mapping[str, Sequence[float]],
    **more: Any,
) -> list[Trace]:
    """The traces of a box over our values of each configuration, and beside it of one over published ones."""
    return [
        {
            "type": "box",
            "name": f"{name}, {whose}",
            "line": {"width": 1.6, "color": colour},
            "boxpoints": False,
            "boxmean": True,
            "y": list(values[name]),
            **more,
        }
        for name in names
        for whose, values, colour in (("ours", ours, "@accent"), ("published", published, "@muted"))
        if len(values.get(name, ()))
    ]


def line(label: str, rows: Records, key: str, colour: str, x: str = "severity", **more: Any) -> Trace:
    """The trace of a line of the values `key` over the values `x` of some rows. more: see `line_trace`."""
    return line_trace(label, [row[x] for row in rows], [row.get(key) for row in rows], colour, **more)


def grouped(rows: Records, *keys: str) -> dict[Any, list[Mapping[str, Any]]]:
    """Value of the key, or values of the keys -> the rows that have them, in the order of the rows."""
    out: dict[Any, list[Mapping[str, Any]]] = {}
    for row in rows:
        values = tuple(row[key] for key in keys)
        out.setdefault(values if len(keys) > 1 else values[0], []).append(row)
    return out


def with_spoken_names(found: Any, skeleton: Json) -> Any:
    """A measurement's JSON in which all labels of columns are names for readers, such as "left thigh".

    A label of a link is for example "LeftUpLeg-LeftLeg". skeleton: the network's, {} if it has none.
    """
    shown_name = shown_names(skeleton)

    def renamed(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {shown_name(key): renamed(item) for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [renamed(item) for item in value]
        return shown_name(value) if isinstance(value, str) else value

    return renamed(found)


def strip(
    skeleton: Json,
    poses: Array,
    colour: str,
    texts: Sequence[tuple[str, float, float]] = (),
    view: str = "side",
    up: float = 0.0,
) -> list[Trace]:
    """The traces of figures side by side, STRIP_WIDTH apart.

    skeleton: the content of its file. poses: (N, J, 3) cm. texts: each with its place, relative to the ground
    below the first figure. view: from the "side" (walking to the right), the "front" or "behind". up: how far
    they stand above the chart's ground, cm.
    """
    joints = list(skeleton["joints"])
    bones = [(joints.index(j["parent"]), i) for i, j in enumerate(skeleton["joints"].values()) if j["parent"]]
    across = {"side": poses[..., 2], "front": poses[..., 0], "behind": -poses[..., 0]}[view]
    x, y = across + STRIP_WIDTH * np.arange(len(poses))[:, None], poses[..., 1] + up
    xs, ys = ([v for pose in axis for a, b in bones for v in (pose[a], pose[b], None)] for axis in (x, y))
    quiet: dict[str, Any] = {"showlegend": False, "hoverinfo": "skip"}
    figures = line_trace("", xs, ys, colour, width=3, **quiet)
    words, x_text, y_text = zip(*texts, strict=True) if texts else ((), (), ())
    places = x_text, [at + up for at in y_text]
    return [figures, marker_trace("", *places, {"size": 1}, mode="text", text=list(words), **quiet)]


def strips(
    name: str, options: Mapping[str, Sequence[Trace]], height: int, choose: str, below: str = ""
) -> Chart:
    """A chart of one of several strips, chosen in a menu. below: a title under the figures."""
    bare = {"showgrid": False, "zeroline": False, "showticklabels": False}
    layout = {"xaxis": {**bare, "title": {"text": below}}, "yaxis": {**bare, "scaleanchor": "x"}}
    return chart(name, layout=layout, height=height, choose=choose, options=options)
