"""Buckets: files through which more rows than fit in memory are shuffled.

Each bucket collects the rows of one stretch of the final order.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hobble.core.errors import InputError
from hobble.core.quat import Array

HINT = "Delete the folder of this file; the next run makes it again."
# For each row: its place in the final order, number of terrain fits, number of its clip, frame, phase.
INDEX = np.dtype([("place", "<i8"), ("count", "<i4"), ("clip", "<i4"), ("frame", "<i4"), ("phase", "<f4")])


def gather_fits(fits: Array, count: np.ndarray, order: np.ndarray) -> Array:
    """The terrain fits of some rows, in the order of these rows.

    fits: (S, columns) fits of R rows, row after row. count: (R,) number of fits of each row. order: indices
    of the rows.
    """
    first = np.cumsum(count) - count
    taken = count[order]
    starts = np.cumsum(taken) - taken
    return fits[np.repeat(first[order] - starts, taken) + np.arange(taken.sum())]


class Buckets:
    """Buckets in the folder `folder`, each for `rows_each` consecutive places in the final order.

    Rows can be added in any order. rows: number of all rows. columns, fit_columns: numbers of columns of a
    row and of a terrain fit.
    """

    def __init__(self, folder: Path, rows: int, rows_each: int, columns: int, fit_columns: int) -> None:
        self.folder, self.rows_each = folder, rows_each
        self.columns, self.fit_columns = columns, fit_columns
        self.count = -(-rows // rows_each)
        folder.mkdir(parents=True)

    def add(self, frames: Array, fits: Array, index: np.ndarray) -> None:
        """Add R rows, with S terrain fits together, to their buckets.

        frames: (R, columns) the rows. fits: (S, fit_columns). index: (R,) of type INDEX.
        """
        bucket = index["place"] // self.rows_each
        order = np.argsort(bucket, kind="stable")
        edges = np.searchsorted(bucket[order], np.arange(self.count + 1))
        for b in np.unique(bucket):
            rows = order[edges[b] : edges[b + 1]]
            self._append(b, "frames", np.asarray(frames[rows], "<f4"))
            self._append(b, "fits", np.asarray(gather_fits(fits, index["count"], rows), "<f4"))
            self._append(b, "index", index[rows])

    def _append(self, bucket: int, table: str, values: np.ndarray) -> None:
        with open(self._file(bucket, table), "ab") as file:
            file.write(values.tobytes())

    def _file(self, bucket: int, table: str) -> Path:
        return self.folder / f"{bucket:05d}.{table}"

    def read(self, bucket: int) -> tuple[Array, Array, np.ndarray]:
        """A bucket's frames, fits and index in the order in which they were added; empty if it has no rows.

        Raises InputError if the lengths of the files do not match.
        """
        if not self._file(bucket, "index").exists():
            return self._tables(np.empty(0, "<f4"), np.empty(0, "<f4"), np.empty(0, INDEX))
        frames, fits = (np.fromfile(self._file(bucket, table), "<f4") for table in ("frames", "fits"))
        index = np.fromfile(self._file(bucket, "index"), INDEX)
        for table, values, size in (
            ("frames", frames, len(index) * self.columns),
            ("fits", fits, int(index["count"].sum()) * self.fit_columns),
        ):
            if len(values) != size:
                raise InputError(self._file(bucket, table), "truncated or overwritten", fix=HINT)
        return self._tables(frames, fits, index)

    def _tables(self, frames: Array, fits: Array, index: np.ndarray) -> tuple[Array, Array, np.ndarray]:
        return frames.reshape(-1, self.columns), fits.reshape(-1, self.fit_columns), index

    def drain(self) -> Iterator[tuple[Array, Array, np.ndarray]]:
        """Each bucket's frames, fits and index in the final order. Removes the files once they are read."""
        for b in range(self.count):
            frames, fits, index = self.read(b)
            for table in ("index", "frames", "fits"):
                self._file(b, table).unlink()
            order = np.argsort(index["place"])
            yield frames[order], gather_fits(fits, index["count"], order), index[order]
