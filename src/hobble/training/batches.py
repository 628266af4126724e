"""Batches of training samples from the database, and a monitor of their losses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from hobble.core.errors import HobbleError
from hobble.database.reader import Database
from hobble.database.sharing import PassSharing, SampleRange
from hobble.training.processes import ALONE, Processes

TRAIN = "train"
CHECK_EVERY = 2048  # samples between checks of the losses; checking every batch would wait for the GPU
DIVERGED = 100.0  # a larger mean loss of a section means that training diverged; predicting the mean gives 1
MOST_NAMED = 8  # at most this many clips or rows are named in a message

Piece = tuple[Tensor, Tensor, Tensor, np.ndarray, np.ndarray]  # x, y, p, clip and frame of a `SampleBatch`


class SampleBatch(NamedTuple):
    """The n samples of a batch that one process has, maybe none, on the device of the training.

    x (n, X) and y (n, Y): standardised. p (n,): phase. clip (n,): index of the clip; frame (n,): its frame.
    total: number of samples of the batch over all processes.
    """

    x: Tensor
    y: Tensor
    p: Tensor
    clip: np.ndarray
    frame: np.ndarray
    total: int


class TrainingRows:
    """The training rows of a database, as one process reads them. A section is a part of a pass over them.

    processes: the processes that share a batch. stretches: number of parts of a section from which each batch
    takes its samples; None: one for each process.
    """

    def __init__(
        self,
        database: Database,
        device: torch.device,
        processes: Processes = ALONE,
        stretches: int | None = None,
    ) -> None:
        self.database, self.device = database, device
        self.processes, self.stretches = processes, stretches

    def sharing(self, section: int, sections: int, size: int) -> PassSharing:
        """How the processes share a section in batches of `size`."""
        total = self.database.section_samples(TRAIN, section, sections)
        return self.processes.sharing(total, size, self.stretches)


class HostRows(TrainingRows):
    """Rows that are read and composed on the host, then copied to `device`."""

    def batches(
        self, pass_index: int, section: int, sections: int, seed: int, size: int
    ) -> Iterator[SampleBatch]:
        """Yield this process's part of each batch of a section. size: samples of a batch over all processes.

        section: from 0 to `sections` - 1 in each pass. seed: of the order of the rows. The last batch may be
        shorter. It is used all the same: so a section uses each of its samples once and leaves none for the
        next section, and a checkpoint between sections is complete.
        """
        order_key = (pass_index, section, sections, seed)
        # The order of the rows depends on this window and must be the same for any number of processes. So
        # the window follows from the size of the whole batch, not of this process's part.
        window = self.database.window(TRAIN, self.database.block_rows(size))
        sharing = self.sharing(section, sections, size)
        stretches = [self._pieces(order_key, stretch, window) for stretch in sharing.own_stretches()]
        for total, _ in sharing.batch_sizes():
            # The last batch may be so short that some stretches have no samples for it.
            pieces = [piece for stretch in stretches if (piece := next(stretch, None)) is not None]
            piece = pieces[0] if len(pieces) == 1 else _joined(pieces, self._nothing)
            yield SampleBatch(*piece, total)

    def _pieces(
        self, order_key: tuple[int, int, int, int], stretch: SampleRange, window: int
    ) -> Iterator[Piece]:
        """The samples of one stretch, batch by batch."""
        size = stretch.high - stretch.low
        rows = self.database.block_rows(size)
        for block in self.database.blocks(TRAIN, *order_key, rows, stretch, window):
            x, y, p = (torch.from_numpy(array).to(self.device) for array in block[:3])
            for start in range(0, len(p), size):
                part = slice(start, start + size)
                yield x[part], y[part], p[part], block.clip[part], block.frame[part]

    @property
    def _nothing(self) -> Piece:
        """A piece without rows."""
        layout, none = self.database.layout, np.empty(0, np.int32)
        x, y = (torch.empty(0, size, device=self.device) for size in (layout.x_size, layout.y_size))
        return x, y, x[:, 0], none, none


def _joined(pieces: Sequence[Piece], nothing: Piece) -> Piece:
    x, y, p, clip, frame = zip(nothing, *pieces, strict=True)
    return torch.cat(x), torch.cat(y), torch.cat(p), np.concatenate(clip), np.concatenate(frame)


class LossWatch:
    """Adds up the losses of a section, and stops the training if it diverges.

    where: names the pass and section in messages. clips: names by index. processes: all of them stop
    together, with the message of the process that has the broken rows. seen, samples: numbers of samples that
    were added, and whose losses were checked.
    """

    def __init__(self, where: str, clips: tuple[str, ...], processes: Processes = ALONE) -> None:
        self.where, self.clips, self.processes = where, clips, processes
        self.seen, self.samples, self._batches, self._total, self._new = 0, 0, 0, 0.0, 0
        self._waiting: list[tuple[Tensor, SampleBatch]] = []
        self._worst: tuple[float, int, SampleBatch] | None = None

    def add(self, loss: Tensor, batch: SampleBatch) -> None:
        """Add a batch and its loss over all processes, a scalar tensor on any device."""
        self._waiting.append((loss, batch))
        self.seen += batch.total
        self._new += batch.total
        if self._new >= CHECK_EVERY:
            self._check()

    def mean(self) -> float:
        """The mean loss over the section's samples; raises HobbleError if training diverged."""
        self._check()
        mean = self._total / max(self.samples, 1)
        if mean > DIVERGED and self._worst is not None:
            raise HobbleError(
                self._message(
                    f"the mean error of the section is {mean:.3g}, and this batch has the largest",
                    *self._worst[1:],
                )
            )
        return mean

    def _check(self) -> None:
        if not self._waiting:
            return
        losses = torch.stack([loss for loss, _ in self._waiting]).double().cpu().numpy()
        for loss, (_, batch) in zip(losses.tolist(), self._waiting, strict=True):
            self._batches += 1
            if not np.isfinite(loss):
                raise HobbleError(self._message("its error is not a finite number", self._batches, batch))
            if loss > DIVERGED and (self._worst is None or loss > self._worst[0]):
                self._worst = (loss, self._batches, batch)
            self.samples += batch.total
            self._total += loss * batch.total
        self._waiting.clear()
        self._new = 0

    def _message(self, what: str, number: int, batch: SampleBatch) -> str:
        text = f"training diverged in {self.where}, batch {number}: {what}"
        return self.processes.most_certain(*self._explained(text, batch))

    def _explained(self, text: str, batch: SampleBatch) -> tuple[str, bool]:
        """`text` with the broken rows or the clips of the batch, and whether broken rows are the cause."""
        x, y, p = (part.isfinite().cpu().numpy() for part in batch[:3])
        bad = ~(x.all(1) & y.all(1) & p)
        if bad.any():
            places = zip(batch.clip[bad], batch.frame[bad], strict=True)
            rows = _name_list([f"{self.clips[clip]} frame {frame}" for clip, frame in places])
            return f"{text}, because rows of the database are not finite: {rows}. Check these frames.", True
        names = _name_list([self.clips[clip] for clip in np.unique(batch.clip)])
        return (
            f"{text}. The batch holds frames of {names}. The last checkpoint is kept. "
            "Lower training.learning_rate, or look for broken frames in these clips."
        ), False


def _name_list(names: list[str]) -> str:
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
