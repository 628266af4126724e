"""Batches of training samples, a check of their losses, and the errors on held-out clips."""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from hobble.core.errors import HobbleError
from hobble.database.order import stretches_of_section
from hobble.database.reader import Database
from hobble.training.processes import ALONE, Processes

TRAIN = "train"
CHECK_EVERY = 2048  # samples between checks of the losses; each check waits for the GPU
# A batch with a larger loss means that training diverged. Predicting the mean of Y gives a loss of 1.
DIVERGED = 1e4
MOST_NAMED = 8  # at most this many clips are named in a message

Piece = tuple[Tensor, Tensor, Tensor, np.ndarray]  # x, y, p and clip of a `SampleBatch`


class SampleBatch(NamedTuple):
    """The n samples of a batch that one process has, maybe none, on the device of the training.

    A sample is a row of the database (a frame of a clip) with one of its terrain fits. x (n, X) and y (n, Y):
    standardised. p (n,): phase. clip (n,): index of the clip. total: number of samples of the batch over all
    processes.
    """

    x: Tensor
    y: Tensor
    p: Tensor
    clip: np.ndarray
    total: int


class HostRows:
    """The training rows, composed by the host and copied to `device`, as one process reads them.

    A section is a part of a pass.

    processes: the processes that share a batch. stretches: number of consecutive parts that a section is cut
    into, a multiple of the number of processes. Each batch takes samples from every part. None: one part for
    each process.
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

    def batches(
        self, pass_index: int, section: int, sections: int, seed: int, size: int
    ) -> Iterator[SampleBatch]:
        """Yield this process's part of each batch of a section. size: samples of a batch over all processes.

        section: from 0 to `sections` - 1 in each pass. seed: of the order of the rows. The last batch may be
        shorter. It is not dropped, so a section uses each of its samples once and leaves none for the next
        section, and a checkpoint between sections is complete.
        """
        order_key = (pass_index, section, sections, seed)
        total = self.database.section_sample_count(TRAIN, section, sections)
        stretches = stretches_of_section(total, size, self.stretches or self.processes.count)
        own = self.processes.own_places(len(stretches))
        parts = [self._pieces(order_key, *stretches[number], size) for number in own]
        for start in range(0, total, size):
            # The last batch may be so short that some stretches have no samples for it.
            pieces = [piece for part in parts if (piece := next(part, None)) is not None]
            piece = pieces[0] if len(pieces) == 1 else _join(pieces, self._empty_piece)
            yield SampleBatch(*piece, min(size, total - start))

    def _pieces(
        self, order_key: tuple[int, int, int, int], samples: range, per_batch: int, size: int
    ) -> Iterator[Piece]:
        """Yield the samples of one stretch, batch by batch: `per_batch` of the `size` samples of a batch."""
        # The number of chunks in memory at a time. The order of the rows depends on it and must be the same
        # for any number of processes. So it follows from the size of the whole batch, not of this part.
        window = self.database.chunks_per_window(TRAIN, self.database.block_rows(size))
        rows = self.database.block_rows(per_batch)
        for block in self.database.blocks(TRAIN, *order_key, rows, samples, window):
            x, y, p = (torch.from_numpy(array).to(self.device) for array in block[:3])
            for start in range(0, len(p), per_batch):
                part = slice(start, start + per_batch)
                yield x[part], y[part], p[part], block.clip[part]

    @property
    def _empty_piece(self) -> Piece:
        layout = self.database.layout
        x, y = (torch.empty(0, size, device=self.device) for size in (layout.x_size, layout.y_size))
        return x, y, x[:, 0], np.empty(0, np.int32)


def _join(pieces: Sequence[Piece], empty: Piece) -> Piece:
    """The samples of all pieces as one piece. empty: a piece without samples, the result for no pieces."""
    x, y, p, clip = zip(empty, *pieces, strict=True)
    return torch.cat(x), torch.cat(y), torch.cat(p), np.concatenate(clip)


class LossWatch:
    """Adds up the losses of a section, and stops the training if it diverges.

    where: names the pass and section in messages. clips: names by index. samples: number of samples that were
    added.
    """

    def __init__(self, where: str, clips: tuple[str, ...]) -> None:
        self.where, self.clips = where, clips
        self.samples, self._batches, self._total = 0, 0, 0.0
        self._waiting: list[tuple[Tensor, SampleBatch]] = []  # loss and batch, not yet checked

    def add(self, loss: Tensor, batch: SampleBatch) -> None:
        """Add a batch and its loss over all processes, a scalar tensor on any device."""
        self._waiting.append((loss, batch))
        before, self.samples = self.samples, self.samples + batch.total
        if self.samples // CHECK_EVERY > before // CHECK_EVERY:
            self._check()

    def mean(self) -> float:
        """The mean loss over the section's samples; raises HobbleError if training diverged."""
        self._check()
        return self._total / max(self.samples, 1)

    def _check(self) -> None:
        losses = torch.stack([loss for loss, _ in self._waiting]).tolist() if self._waiting else []
        for loss, (_, batch) in zip(losses, self._waiting, strict=True):
            self._batches += 1
            if not loss <= DIVERGED:
                raise self._diverged(loss, batch)
            self._total += loss * batch.total
        self._waiting.clear()

    def _diverged(self, loss: float, batch: SampleBatch) -> HobbleError:
        names = [self.clips[clip] for clip in np.unique(batch.clip)]
        more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        return HobbleError(
            f"training diverged in {self.where}, batch {self._batches}: its error is {loss:.3g}. The batch "
            f"holds frames of {', '.join(names[:MOST_NAMED])}{more}. The last checkpoint is kept. Lower "
            "training.learning_rate, or look for broken frames in these clips."
        )


# The error on held-out clips, which are not trained on: over all outputs, and for each block of Y.


HELD_OUT = "held_out"
ROWS_AT_ONCE = 2048  # rows predicted at once: enough to be fast, in less than 50 MB
# A network: standardised outputs (B, Y) of standardised inputs (B, X) at phases (B,).
Predict = Callable[[Tensor, Tensor], Tensor]


class HeldOutErrors:
    """Measures a network on a sample of the held-out clips' rows, each with one of its terrain fits.

    section_samples: number of training samples in a section. The held-out sample has a tenth as many rows,
    but at least 2,000 and at most 20,000, so measuring it after each section takes a few percent of the
    training time. The sample is kept in memory.
    """

    def __init__(self, database: Database, device: torch.device, section_samples: int) -> None:
        self.database, self.device = database, device
        self.blocks = database.layout.blocks("y")
        rows = min(20_000, max(2_000, section_samples // 10))
        self.sample: list[tuple[Tensor, ...]] = []
        for batch in self._batches():
            self.sample.append(tuple(part[:rows] for part in batch))
            rows -= len(batch[0])
            if rows <= 0:
                break

    def errors(self, network: Predict, every_row: bool = False) -> list[float]:
        """The mean squared error of the whole standardised output, then of each block of Y.

        every_row: whether to measure all held-out rows instead of the sample. The blocks have the order of
        `RowLayout.blocks("y")`. Without held-out rows, all errors are nan.
        """
        total, rows = np.zeros(self.database.layout.y_size), 0
        for x, y, p in self._batches() if every_row else self.sample:
            squares = torch.square(network(x, p).sub_(y))
            total += squares.sum(0, dtype=torch.float64).cpu().numpy()
            rows += len(x)
        mean = total / rows if rows else np.full(len(total), np.nan)
        # The database multiplies the change of phase by phase_weight. This is undone here, so that networks
        # that were trained with different phase weights can be compared.
        mean[self.blocks["phase_change"]] /= self.database.phase_weight**2
        return [float(mean.mean()), *(float(mean[columns].mean()) for columns in self.blocks.values())]

    def _batches(self) -> Iterator[tuple[Tensor, ...]]:
        """Yield every row once, with one of its terrain fits and in random order, as batches (x, y, p).

        A pass uses every row `visits` times. So if it is cut into `visits` sections, its first section has
        every row once.
        """
        visits = self.database.manifest.visits
        for block in self.database.blocks(HELD_OUT, 0, 0, visits, 0, ROWS_AT_ONCE):
            yield tuple(torch.from_numpy(array).to(self.device) for array in block[:3])
