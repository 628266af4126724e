"""Size of a database, and of the same data in the layout of Holden et al. (2017).

Also estimates the size of a database of the clips that Holden et al. released.
"""

from __future__ import annotations

from typing import TypedDict

from hobble.database.manifest import Manifest
from hobble.database.plan import INDEX_BYTES
from hobble.database.precision import STORED
from hobble.rows.compose import column_count_without_terrain, fit_column_count

# Number of frames at 60 Hz, mirrored ones included, in the clips released with Holden, Komura, Saito (2017).
RELEASED_FRAMES = 465_990
# Share of these frames that are on flat ground. Such a frame has one terrain fit, another frame has ten.
RELEASED_FLAT = 0.479


class Sizes(TypedDict):
    """Sizes of a database. A terrain fit of a frame is a set of ground heights that suit its motion.

    joints: number of joints. dtype: type of the numbers on disk. frames: number of frames in both splits
    together. pairs: number of pairs of a frame and a terrain fit that one pass over the data uses. It counts
    the single fit of a frame on flat ground as often as the pass uses it. bytes: size of all chunks.
    original_bytes: size of all pairs as rows of X, Y and P in float32. share: bytes / original_bytes.
    bytes_a_frame: bytes / frames, with the terrain fits. released_frames: number of frames of the released
    clips. released_bytes: their estimated size with the columns and number type of this database.
    """

    joints: int
    dtype: str
    frames: int
    pairs: int
    bytes: int
    original_bytes: int
    share: float
    bytes_a_frame: float
    released_frames: int
    released_bytes: int


def database_sizes(manifest: Manifest) -> Sizes:
    """The sizes of a database."""
    frames = sum(manifest.row_count(split) for split in manifest.chunks)
    layout, number_bytes = manifest.layout, STORED[manifest.dtype].itemsize
    frame_bytes = number_bytes * (column_count_without_terrain(layout) + layout.y_size) + INDEX_BYTES
    fits_a_frame = RELEASED_FLAT + (1 - RELEASED_FLAT) * manifest.visits
    released = RELEASED_FRAMES * (frame_bytes + fits_a_frame * number_bytes * fit_column_count(layout))
    return {
        "joints": layout.joints,
        "dtype": manifest.dtype,
        "frames": frames,
        "pairs": frames * manifest.visits,
        "bytes": manifest.bytes,
        "original_bytes": manifest.original_bytes,
        "share": manifest.bytes / manifest.original_bytes,
        "bytes_a_frame": manifest.bytes / frames,
        "released_frames": RELEASED_FRAMES,
        "released_bytes": round(released),
    }
