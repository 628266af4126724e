"""Clips of smooth, made-up motion as files of rows, and the tables built from them."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.skeleton import Skeleton
from hobble.models import network_options
from hobble.models.load import network_from_arrays
from hobble.models.model import BuiltOptions, FinishedNetwork
from hobble.rows.clip_rows import ClipRows, save_clip_rows
from hobble.rows.layout import RowLayout, body_layout, column_count_without_terrain

FRAMES = (70, 90)  # of each clip
CUT = 40  # the first clip's second cycle begins in the frame with which its first ends


def layout_of(skeleton: Skeleton) -> RowLayout:
    return RowLayout(len(skeleton.joints), channels=(("injury", 30),))


def smooth(rng: np.random.Generator, rows: int, columns: int, size: float) -> np.ndarray:
    """(rows, columns), each column another sine."""
    t = np.arange(rows)[:, None] / 60
    rate, start = rng.uniform(0.5, 2, columns), rng.uniform(0, 7, columns)
    return (size * np.sin(2 * np.pi * rate * t + start)).astype(np.float32)


def clip(skeleton: Skeleton, number: int, seed: int = 1) -> ClipRows:
    """A clip of two cycles that share a frame, with two fits for each row."""
    layout, rng = layout_of(skeleton), np.random.default_rng([seed, number])
    count = FRAMES[number]
    once = np.arange(count)
    row = np.concatenate([once[: CUT + 1], once[CUT:]])
    y = smooth(rng, count, layout.y_size, 10.0)
    y[:, layout.y_joint_rotation] = smooth(rng, count, 3 * layout.joints, 0.4)
    y[:, layout.y_phase_change] = 0.02
    injury = np.zeros((count, 30), np.float32)
    injury[:, 4] = 7.0 * (number == 1)
    heights = smooth(rng, 2 * len(row), 3 * layout.samples, 5.0)
    return ClipRows(
        clip=f"clip-{number}",
        layout=layout,
        skeleton=skeleton.to_dict(),
        x=smooth(rng, count, column_count_without_terrain(body_layout(layout)), 10.0)[row],
        y=y[row],
        p=(0.02 * row) % 1.0,
        channels={"injury": injury[row]},
        frame=(100 + row).astype(np.int32),
        cycle=np.r_[np.zeros(CUT + 1, np.int32), np.ones(count - CUT, np.int32)],
        fits=np.full(len(row), 2, np.int32),
        heights=heights,
        mean=smooth(rng, 2 * len(row), 1, 3.0)[:, 0],
    )


def clip_files(skeleton: Skeleton, folder: Path) -> list[Path]:
    """The files of both clips."""
    files = []
    for number in range(len(FRAMES)):
        files.append(folder / f"clip-{number}.npz")
        save_clip_rows(files[-1], clip(skeleton, number))
    return files


def built(
    skeleton: Skeleton, folder: Path, kind: str = "matching", **options: Any
) -> tuple[FinishedNetwork, dict[str, Any], Any]:
    """The network built from both clips, the arrays of its file, and the network read from them."""
    layout = layout_of(skeleton)
    chosen = network_options({"kind": kind, **options})
    assert isinstance(chosen, BuiltOptions)
    tables = chosen.build(clip_files(skeleton, folder), layout, skeleton)
    rng = np.random.default_rng(1)
    arrays: dict[str, Any] = dict(tables.arrays)
    for name, size in (("X", layout.x_size), ("Y", layout.y_size)):
        arrays[f"{name}mean"] = rng.normal(0, 10, size).astype(np.float32)
        arrays[f"{name}std"] = rng.uniform(0.5, 2, size).astype(np.float32)
    own = {"layout": layout.to_dict(), "skeleton": skeleton.to_dict(), **tables.meta}
    meta = {"kind": kind, "channels": {"injury": skeleton.link_names}, **own}
    arrays["meta"] = np.array(json.dumps(meta))
    return tables, arrays, network_from_arrays("weights.npz", arrays)
