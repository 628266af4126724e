"""Size of a database, and of the same data in the layout of Holden et al. (2017).

Also estimates the size of a database of the clips that Holden et al. released.
"""

from __future__ import annotations

from typing import TypedDict

from hobble.database.manifest import Manifest
from hobble.database.plan import INDEX_BYTES
from hobble.database.precision import STORED
from hobble.rows.compose import fit_columns, x_columns

# Number of frames at 60 Hz, mirrored ones included, in the clips released with Holden, Komura, Saito (2017).
RELEASED_FRAMES = 465_990
RELEASED_FLAT = 0.479  # share of these frames on flat ground: they have one terrain fit, the others ten


class Sizes(TypedDict):
    """Sizes of a database.

    joints: number of joints. dtype: type of the numbers on disk. frames: number of frames in both splits
    together. pairs: number of (frame, terrain fit) pairs of a pass over these frames; a frame on flat ground
    has its only fit several times. bytes: size of all chunks. original_bytes: size of the pairs as rows of X,
    Y and P in float32. share: bytes / original_bytes. bytes_a_frame: bytes of a frame with its terrain fits.
    released_frames, released_bytes: number of frames of the released clips, and their size with this layout
    and type.
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


def sizes(manifest: Manifest) -> Sizes:
    """The sizes of a database."""
    frames = sum(manifest.rows(split) for split in manifest.chunks)
    layout, item = manifest.layout, STORED[manifest.dtype].itemsize
    frame_bytes = item * (x_columns(layout) + layout.y_size) + INDEX_BYTES
    fits = RELEASED_FLAT + (1 - RELEASED_FLAT) * manifest.visits
    released = RELEASED_FRAMES * (frame_bytes + fits * item * fit_columns(layout))
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
