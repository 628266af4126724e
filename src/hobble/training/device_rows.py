"""The training rows of a database in the memory of an accelerator, which composes the batches."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch
from torch import Tensor

from hobble.database import order
from hobble.database.chunks import Manifest
from hobble.database.order import SampleRange, SectionSharing
from hobble.database.reader import Database, empty_buffers
from hobble.rows.layout import column_count_without_terrain, compose, fit_column_count
from hobble.training.batches import TRAIN, HostRows, SampleBatch, TrainingRows
from hobble.training.processes import ALONE, Processes

ROWS_AT_ONCE = 4096  # about how many rows are composed at a time; this takes few kernel launches and 10 MB
MEMORY_SHARE = 0.6  # share of the device's memory for rows; the network and its buffers need the rest


class DeviceRows(TrainingRows):
    """All training rows in the memory of the device. They are uploaded chunk by chunk to save host memory.

    The batches equal those of a `HostRows` that can hold all rows in memory. The host computes only the
    order of rows and terrain fits, and sends it once a section.

    Tables on the device: x (rows, columns of X without terrain), y (rows, Y), phase (rows,), and fits (all
    terrain fits of all rows, their columns). Arrays (rows,) on the host: count, the number of a row's fits;
    first, the index of its first fit in `fits`; clip and frame, where the row is from.
    """

    def __init__(
        self,
        database: Database,
        device: torch.device,
        processes: Processes = ALONE,
        stretches: int | None = None,
    ) -> None:
        super().__init__(database, device, processes, stretches)
        manifest = database.manifest
        self.chunks = manifest.chunks[TRAIN]
        rows, fits = sum(c.rows for c in self.chunks), sum(c.fits for c in self.chunks)
        dtype = getattr(torch, manifest.dtype)
        layout = database.layout
        self.x = torch.empty(rows, column_count_without_terrain(layout), dtype=dtype, device=device)
        self.y = torch.empty(rows, layout.y_size, dtype=dtype, device=device)
        self.fits = torch.empty(fits, fit_column_count(layout), dtype=dtype, device=device)
        self.phase = torch.empty(rows, device=device)
        self.count, self.clip, self.frame = (np.empty(rows, np.int32) for _ in range(3))
        self._upload()
        self.first_fit = order.first_fits(self.count)
        s = database.statistics
        self.x_std, self.y_std = (torch.from_numpy(std).to(device) for std in (s.x_std, s.y_std))

    def _upload(self) -> None:
        """Read the chunks, one at a time, and copy them to the tables."""
        row = fit = 0
        buffers = empty_buffers(self.database.manifest, TRAIN, 1)
        for number, chunk in enumerate(self.chunks):
            rows, fits = slice(row, row + chunk.rows), slice(fit, fit + chunk.fits)
            read = self.database.load(TRAIN, [number], buffers)
            for table, values in (
                (self.x[rows], read.x),
                (self.y[rows], read.y),
                (self.fits[fits], read.fits),
                (self.phase[rows], read.phase),
            ):
                # NumPy has no bfloat16: such values are read as uint16. `view` keeps the bits.
                table.copy_(torch.from_numpy(values).view(table.dtype))
            self.count[rows], self.clip[rows], self.frame[rows] = read.count, read.clip, read.frame
            row, fit = rows.stop, fits.stop

    def batches(
        self, pass_index: int, section: int, sections: int, seed: int, size: int
    ) -> Iterator[SampleBatch]:
        """Yield this process's part of each batch, see `hobble.training.batches.HostRows.batches`."""
        sharing = self.share_section(section, sections, size)
        rows, fits = self._own_indices(sharing, (pass_index, section, sections, seed))
        device_rows, device_fits = (torch.from_numpy(part).to(self.device) for part in (rows, fits))
        batch_rows = len(sharing.own)  # rows of this process in a batch
        step = batch_rows * max(1, ROWS_AT_ONCE // batch_rows)  # rows composed at a time: whole batches
        sizes = sharing.batch_sizes()
        for at in range(0, max(len(rows), 1), step):
            x, y, p = self._compose(device_rows[at : at + step], device_fits[at : at + step])
            composed = rows[at : at + step]
            clip, frame = self.clip[composed], self.frame[composed]
            for start in range(0, len(p), batch_rows):
                part = slice(start, start + batch_rows)
                yield SampleBatch(x[part], y[part], p[part], clip[part], frame[part], next(sizes)[0])
        for total, _ in sizes:  # the last batch is too short to have rows for this process
            yield SampleBatch(x[:0], y[:0], p[:0], clip[:0], frame[:0], total)

    def _own_indices(
        self, sharing: SectionSharing, order_key: tuple[int, int, int, int]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Indices (n,) of the rows that this process has in a section, batch by batch, and of their fits.

        order_key: pass, section, number of sections and seed.
        """
        parts, batch_numbers = [], []  # one item for each stretch
        for stretch in sharing.own_stretches():
            layers = list(self._indices_of_stretch(*order_key, stretch))
            rows, fits = (np.concatenate(indices) for indices in zip(*layers, strict=True))
            own = stretch.own_samples(0, len(rows))
            parts.append((rows[own], fits[own]))
            batch_numbers.append(np.arange(len(parts[-1][0])) // (stretch.high - stretch.low))
        rows, fits = (np.concatenate(indices) for indices in zip(*parts, strict=True))
        if len(batch_numbers) == 1:
            return rows, fits
        by_batch = np.argsort(np.concatenate(batch_numbers), kind="stable")
        return rows[by_batch], fits[by_batch]

    def _indices_of_stretch(
        self, pass_index: int, section: int, sections: int, seed: int, stretch: SampleRange
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield the indices (n,) of the rows and (n,) of the fits of a stretch, in order.

        They come layer by layer: a layer visits each row once. All chunks are one group, that is, their rows
        are shuffled together.
        """
        visits, part = self.database.manifest.visits, (stretch.start, stretch.stop)
        chunks, chunk_rows = range(len(self.chunks)), [chunk.rows for chunk in self.chunks]
        nothing = np.empty(0, np.int64)
        yield nothing, nothing  # so that even an empty stretch has arrays to join
        for layer, start, stop in order.layer_parts(len(self.count), visits, section, sections, part):
            layer_key = (seed, pass_index, layer, 0)  # 0: the number of the only group
            yield order.rows_and_fits(
                chunks, chunk_rows, self.count, self.first_fit, visits, layer_key, slice(start, stop)
            )

    def _compose(self, rows: Tensor, fits: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """x (n, X), y (n, Y) and p (n,), composed on the device. rows, fits: (n,) indices into the tables."""
        layout = self.database.layout
        # The last column of `self.fits` is the lift: by how many cm the joint heights have to be lowered for
        # this fit.
        ground, y = self.fits[fits].float(), self.y[rows].float()
        x = torch.empty(len(rows), layout.x_size, device=self.device)
        frames, lift = self.x[rows].float(), ground[:, -1:]
        compose(layout, frames, ground[:, :-1], lift, x, y, self.x_std, self.y_std)
        return x, y, self.phase[rows]


def rows_on_device_or_host(
    database: Database, device: torch.device, processes: Processes = ALONE, stretches: int | None = None
) -> HostRows | DeviceRows:
    """The training rows: in the memory of the GPU if it is large enough, else read by the host.

    processes, stretches: see `TrainingRows`.
    """
    on_device = device.type == "cuda" and gpu_has_room(device, database.manifest)
    return (DeviceRows if on_device else HostRows)(database, device, processes, stretches)


def gpu_has_room(device: torch.device, manifest: Manifest) -> bool:
    """Whether the GPU has memory for the training rows and for the training itself.

    Uses the total memory, not the free memory: rows can have another order on the GPU than on the host, so a
    resumed run must make the same choice as before.
    """
    needed = sum(chunk.bytes for chunk in manifest.chunks[TRAIN])
    return needed < MEMORY_SHARE * torch.cuda.mem_get_info(device)[1]
