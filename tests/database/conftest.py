"""Made-up rows, few enough to compare all of them."""

from collections.abc import Callable

import numpy as np
import pytest

from hobble.rows.clip_rows import ClipRows
from hobble.rows.layout import RowLayout

LAYOUT = RowLayout(joints=3, channels=(("injury", 2),))
SKELETON = {
    "name": "stick",
    "joints": {
        "Hips": {"parent": None, "offset": [0, 0, 0]},
        "Spine": {"parent": "Hips", "offset": [0, 20, 0]},
        "Head": {"parent": "Spine", "offset": [0, 30, 0]},
    },
    "roles": {},
    "links": [["Hips", "Spine"], ["Spine", "Head"]],
    "unseen": ["Spine"],
}
MakeRows = Callable[..., ClipRows]


def make_rows(clip: str = "a", rows: int = 50, fits: int | None = 1, seed: int = 0) -> ClipRows:
    """Random rows of one clip, with `fits` fits each; with None, each row has 1 or 10 at random."""
    rng = np.random.default_rng(seed)
    count = np.full(rows, fits) if fits else rng.choice([1, 10], rows)
    total = int(count.sum())

    def normal(*shape: int, scale: float = 1.0) -> np.ndarray:
        return (scale * rng.normal(size=shape) + rng.normal(size=shape[-1])).astype(np.float32)

    return ClipRows(
        clip=clip,
        layout=LAYOUT,
        skeleton=SKELETON,
        x=normal(rows, LAYOUT.x_terrain.start, scale=20),
        y=normal(rows, LAYOUT.y_size, scale=5),
        p=rng.random(rows).astype(np.float32),
        channels={
            "injury": (rng.random((rows, 2)) < 0.2)
            * rng.choice([3.0, 7.0, 10.0], (rows, 2)).astype(np.float32)
        },
        frame=np.arange(60, 60 + rows, dtype=np.int32),
        cycle=np.zeros(rows, np.int32),
        fits=count.astype(np.int32),
        heights=normal(total, 3 * LAYOUT.samples, scale=8),
        mean=np.asarray(normal(total, 1, scale=30)[:, 0]),
        visits=10,
    )


@pytest.fixture(scope="session")
def rows_of() -> MakeRows:
    """Makes random rows; see `make_rows`."""
    return make_rows


@pytest.fixture(scope="session")
def layout() -> RowLayout:
    """The layout of the made-up rows."""
    return LAYOUT
