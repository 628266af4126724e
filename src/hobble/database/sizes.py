"""How large a database is, beside the original's layout and at the size of the data that the original had."""

from __future__ import annotations

from typing import Any

from hobble.database.manifest import Manifest
from hobble.database.precision import STORED
from hobble.rows.compose import fit_columns, x_columns

RELEASED_FRAMES = 465_990  # at 60 Hz, mirrors included, in the released clips of Holden, Komura, Saito (2017)
RELEASED_FLAT = 0.479  # share of them on flat ground, which have one fit and not ten
BESIDE = 16  # bytes of a row beside its floats: count of fits, clip, frame, phase


def sizes(manifest: Manifest) -> dict[str, Any]:
    """The numbers as plain data.

    frames, pairs: of both splits, a pair being a frame with one of its fits as often as a pass shows it.
    bytes: of all chunks. original_bytes: the same pairs as rows of X, Y and P in float32. share: of the one
    in the other. bytes_a_frame: with its fits. released_bytes: what every frame of the released clips would
    take, none left out, in this layout and type.
    """
    frames = sum(manifest.rows(split) for split in manifest.chunks)
    layout, item = manifest.layout, STORED[manifest.dtype].itemsize
    a_frame = item * (x_columns(layout) + layout.y_size) + BESIDE
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
