"""Buckets: files that help to shuffle the rows of a database, which may be more than fit in memory.

A row is a frame of a clip as a network gets it, with one or more terrain fits (ground heights that suit the
motion). The random order in which the rows are stored, the final order, is cut into stretches. Each bucket
collects the rows of one stretch, and later these few rows are sorted in memory.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hobble.core.errors import InputError
from hobble.core.quat import Array

HINT = "Delete the folder of this file; the next run makes it again."
# For each row: its place in the final order, its number of terrain fits, the number of its clip, its frame in
# this clip, and its phase.
INDEX = np.dtype([("place", "<i8"), ("count", "<i4"), ("clip", "<i4"), ("frame", "<i4"), ("phase", "<f4")])


def gather_fits(fits: Array, count: np.ndarray, order: np.ndarray) -> Array:
    """The terrain fits (n, columns) of the rows with the indices `order`, in the order of these rows.

    fits: (S, columns) fits of R rows, row after row. count: (R,) number of fits of each row.
    """
    first = np.cumsum(count) - count  # index in `fits` of each row's first fit
    chosen = count[order]
    first_in_result = np.cumsum(chosen) - chosen
    return fits[np.repeat(first[order] - first_in_result, chosen) + np.arange(chosen.sum())]


class Buckets:
    """The buckets in a folder, each with the rows of `rows_per_bucket` consecutive places in the final order.

    Rows can be added in any order. rows: number of all rows. columns, fit_columns: number of columns of a row
    and of a terrain fit. A bucket has three files, called tables here: "frames" (the rows), "fits" and
    "index". count: number of buckets.
    """

    def __init__(self, folder: Path, rows: int, rows_per_bucket: int, columns: int, fit_columns: int) -> None:
        self.folder, self.rows_per_bucket = folder, rows_per_bucket
        self.columns, self.fit_columns = columns, fit_columns
        self.count = -(-rows // rows_per_bucket)  # rounded up
        folder.mkdir(parents=True)

    def add(self, frames: Array, fits: Array, index: np.ndarray) -> None:
        """Add R rows, with S terrain fits together, to their buckets.

        frames: (R, columns) the rows. fits: (S, fit_columns) their fits, row after row. index: (R,) of type
        INDEX.
        """
        of_rows = index["place"] // self.rows_per_bucket
        order = np.argsort(of_rows, kind="stable")
        edges = np.searchsorted(of_rows[order], np.arange(self.count + 1))
        for bucket in np.unique(of_rows):
            rows = order[edges[bucket] : edges[bucket + 1]]
            self._append(bucket, "frames", np.asarray(frames[rows], "<f4"))
            self._append(bucket, "fits", np.asarray(gather_fits(fits, index["count"], rows), "<f4"))
            self._append(bucket, "index", index[rows])

    def _append(self, bucket: int, table: str, values: np.ndarray) -> None:
        with open(self._file(bucket, table), "ab") as file:
            file.write(values.tobytes())

    def _file(self, bucket: int, table: str) -> Path:
        return self.folder / f"{bucket:05d}.{table}"

    def read(self, bucket: int) -> tuple[Array, Array, np.ndarray]:
        """The tables frames, fits and index of a bucket, in the order in which rows were added.

        They are empty if the bucket has no rows. Raises InputError if the lengths of the files do not match.
        """
        if not self._file(bucket, "index").exists():
            return self._reshape(np.empty(0, "<f4"), np.empty(0, "<f4"), np.empty(0, INDEX))
        frames, fits = (np.fromfile(self._file(bucket, table), "<f4") for table in ("frames", "fits"))
        index = np.fromfile(self._file(bucket, "index"), INDEX)
        for table, values, size in (
            ("frames", frames, len(index) * self.columns),
            ("fits", fits, int(index["count"].sum()) * self.fit_columns),
        ):
            if len(values) != size:
                raise InputError(self._file(bucket, table), "truncated or overwritten", fix=HINT)
        return self._reshape(frames, fits, index)

    def _reshape(self, frames: Array, fits: Array, index: np.ndarray) -> tuple[Array, Array, np.ndarray]:
        return frames.reshape(-1, self.columns), fits.reshape(-1, self.fit_columns), index

    def drain(self) -> Iterator[tuple[Array, Array, np.ndarray]]:
        """Yield the frames, fits and index of each bucket in the final order. Removes the files once read."""
        for bucket in range(self.count):
            frames, fits, index = self.read(bucket)
            for table in ("index", "frames", "fits"):
                self._file(bucket, table).unlink()
            order = np.argsort(index["place"])
            yield frames[order], gather_fits(fits, index["count"], order), index[order]
