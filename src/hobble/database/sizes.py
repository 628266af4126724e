"""Size of a database, compared with the original's layout, and scaled to the original's data."""

from __future__ import annotations

from typing import TypedDict

from hobble.database.manifest import Manifest
from hobble.database.precision import STORED
from hobble.rows.compose import fit_columns, x_columns

RELEASED_FRAMES = 465_990  # at 60 Hz, mirrors included, in the released clips of Holden, Komura, Saito (2017)
RELEASED_FLAT = 0.479  # share of these frames on flat ground: they have one terrain fit, the others ten
INDEX_BYTES = 16  # bytes of a row besides its floats: count of fits, clip, frame, phase


class Sizes(TypedDict):
    """Sizes of a database.

    frames, pairs: numbers in both splits; a pass over the data has every pair once. bytes: of all chunks.
    original_bytes: the same pairs as rows of X, Y and P in float32. share: bytes / original_bytes.
    bytes_a_frame: bytes of a frame with its terrain fits. released_frames, released_bytes: number of frames
    of the released clips, and their size in this layout and type.
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
    a_frame = item * (x_columns(layout) + layout.y_size) + INDEX_BYTES
    fits = RELEASED_FLAT + (1 - RELEASED_FLAT) * manifest.visits
    released = RELEASED_FRAMES * (a_frame + fits * item * fit_columns(layout))
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
