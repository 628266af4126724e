"""The training rows of a database on an accelerator, shuffled and composed there."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch
from torch import Tensor

from hobble.database import order
from hobble.database.chunks import read_chunk
from hobble.database.manifest import Manifest
from hobble.database.precision import STORED
from hobble.database.reader import Database
from hobble.rows.compose import compose, fit_columns, x_columns
from hobble.training.batches import TRAIN, Batch, HostRows

AT_ONCE = 4096  # rows composed in one go: few launches, 10 MB
OF_MEMORY = 0.6  # of the device's; the rest is for the network and its buffers


class DeviceRows:
    """All training rows of `database`, uploaded chunk by chunk, so that only one is in the host's memory.

    What comes is what the database's own reader gives where it holds every row at a time. Only which row
    and which of its fits comes next is found on the host, and sent once a section.
    """

    def __init__(self, database: Database, device: torch.device) -> None:
        self.database, self.device = database, device
        manifest = database.manifest
        self.chunks = manifest.chunks[TRAIN]
        rows, fits = sum(c.rows for c in self.chunks), sum(c.fits for c in self.chunks)
        dtype = getattr(torch, manifest.dtype)
        layout = database.layout
        self.x = torch.empty(rows, x_columns(layout), dtype=dtype, device=device)
        self.y = torch.empty(rows, layout.y_size, dtype=dtype, device=device)
        self.fits = torch.empty(fits, fit_columns(layout), dtype=dtype, device=device)
        self.phase = torch.empty(rows, device=device)
        self.count, self.clip, self.frame = (np.empty(rows, np.int32) for _ in range(3))
        self._upload()
        self.first = np.cumsum(self.count, dtype=np.int64) - self.count
        s = database.statistics
        self.x_std, self.y_std = (torch.from_numpy(std).to(device) for std in (s.x_std, s.y_std))

    def _upload(self) -> None:
        row = fit = 0
        for chunk in self.chunks:
            rows, fits = slice(row, row + chunk.rows), slice(fit, fit + chunk.fits)
            tables = {"x": self.x[rows], "y": self.y[rows], "fits": self.fits[fits]}
            stored = STORED[self.database.manifest.dtype]
            parts = {name: np.empty(table.shape, stored) for name, table in tables.items()} | {
                "count": self.count[rows],
                "clip": self.clip[rows],
                "frame": self.frame[rows],
                "phase": np.empty(chunk.rows, np.float32),
            }
            read_chunk(self.database.path / self.database.manifest.folder, chunk, parts)
            for name, table in tables.items():
                table.copy_(torch.from_numpy(parts[name]).view(table.dtype))
            self.phase[rows] = torch.from_numpy(parts["phase"]).to(self.device)
            row, fit = rows.stop, fits.stop

    def batches(self, pass_index: int, section: int, sections: int, seed: int, size: int) -> Iterator[Batch]:
        """As `hobble.training.batches.HostRows.batches`."""
        places = list(self._places(pass_index, section, sections, seed))
        rows, fits = (np.concatenate(part) for part in zip(*places, strict=True))
        sent, fits_sent = (torch.from_numpy(part).to(self.device) for part in (rows, fits))
        step = size * max(1, AT_ONCE // size)
        for at in range(0, len(rows), step):
            x, y, p = self._composed(sent[at : at + step], fits_sent[at : at + step])
            of_host = rows[at : at + step]
            clip, frame = self.clip[of_host], self.frame[of_host]
            for start in range(0, len(p), size):
                part = slice(start, start + size)
                yield Batch(x[part], y[part], p[part], clip[part], frame[part])

    def _places(
        self, pass_index: int, section: int, sections: int, seed: int
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Rows and fits of a section in their order, a layer at a time."""
        visits = self.database.manifest.visits
        ends = np.cumsum([chunk.rows for chunk in self.chunks])
        for layer, start, stop in order.spans(len(self.count), visits, section, sections):
            of = (seed, pass_index, layer)
            rows = order.row_order(len(self.count), *of, 0)[start:stop]
            picked = [
                order.picks(self.count[end - chunk.rows : end], visits, *of, number)
                for number, (chunk, end) in enumerate(zip(self.chunks, ends, strict=True))
            ]
            yield rows, self.first[rows] + np.concatenate(picked)[rows]

    def _composed(self, rows: Tensor, fits: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """x (n, X), y (n, Y) and p (n,), composed where they lie."""
        layout = self.database.layout
        ground, y = self.fits[fits].float(), self.y[rows].float()
        x = torch.empty(len(rows), layout.x_size, device=self.device)
        frames, lift = self.x[rows].float(), ground[:, -1:]
        compose(layout, frames, ground[:, :-1], lift, x, y, self.x_std, self.y_std)
        return x, y, self.phase[rows]


def rows_for(database: Database, device: torch.device) -> HostRows | DeviceRows:
    """The training rows on an accelerator where they have room there, else composed by the host."""
    if device.type == "cuda" and fits_on(device, database.manifest):
        return DeviceRows(database, device)
    return HostRows(database, device)


def fits_on(device: torch.device, manifest: Manifest) -> bool:
    """Whether the training rows have room on an accelerator beside what the training itself needs.

    By all its memory, not by what is free: the order of the rows depends on it, and a run that goes on has to
    take them in the same.
    """
    needed = sum(chunk.bytes for chunk in manifest.chunks[TRAIN])
    return needed < OF_MEMORY * torch.cuda.mem_get_info(device)[1]
