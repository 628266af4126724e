"""The update of one batch: gradient and optimiser step; on CUDA as one captured graph."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from hobble.models.trainable import ALL_ROWS, TrainingStep
from hobble.training.optimiser import Adam
from hobble.training.processes import ALONE, Processes

# Batches of at most this many rows are captured. In larger ones, kernel launches cost little compared with
# matrix products.
CAPTURED_UP_TO = 1024
WARM_UP = 3  # updates before the capture, in which libraries choose algorithms and allocate memory


class Update:
    """Draws the dropout masks of a batch, computes the gradient and takes a step.

    kept: blocks of inputs that dropout never drops, such as channels. A dropped input gets its mean value: if
    channels were dropped, a hurt body would seem less hurt, and the network would rely less on its channels.
    """

    def __init__(self, step: TrainingStep, adam: Adam, kept: Sequence[slice] = ()) -> None:
        self.step, self.adam, self.kept = step, adam, kept

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """The masks for the rows `own` of a batch of `rows` rows."""
        masks = self.step.masks(rows, own)
        for block in self.kept:
            masks[self.step.input_mask][:, block] = 1.0
        return masks

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, share: float, total: int | None = None) -> Tensor:
        """Train on x (B, X), y (B, Y), p (B,). Returns the loss, a scalar tensor.

        share: factor of the learning rate. total: rows of the batch over all processes, if there are several.
        """
        loss = self.step(x, y, p, self.masks(len(x)))
        self.adam.step(self.step.gradients, share)
        return loss


class SharedUpdate(Update):
    """The update by several processes. Each has its own rows of the batch, maybe none.

    The loss is a mean over the rows of the batch. So each process multiplies its gradient and loss by its
    share of the rows. Then the sums over the processes are gradient and loss of the whole batch. Both are
    sent together.
    """

    def __init__(
        self, step: TrainingStep, adam: Adam, processes: Processes, batch: int, kept: Sequence[slice] = ()
    ) -> None:
        super().__init__(step, adam, kept)
        self.processes, self.own = processes, processes.places(batch)
        self.sent = torch.empty(len(adam.network.flat) + 1, dtype=adam.network.flat.dtype)
        self.sent = self.sent.to(adam.network.flat.device)
        self.gradients = adam.network.views(self.sent[:-1])

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, share: float, total: int | None = None) -> Tensor:
        """See `Update.__call__`. The loss is that of the whole batch."""
        total = total or len(p)
        masks = self.masks(total, slice(self.own.start, self.own.stop))
        if len(p):
            loss = self.step(x, y, p, masks)
            for sent, gradient in zip(self.gradients, self.step.gradients, strict=True):
                sent.copy_(gradient.view(sent.shape))
            self.sent[-1] = loss
            self.sent.mul_(len(p) / total)
        else:
            self.sent.zero_()
            self.step.error = self.step.error[:0]
        self.processes.sum(self.sent)
        self.adam.step(self.gradients, share)
        return self.sent[-1].clone()


class CapturedUpdate(Update):
    """The update on a CUDA device for batches of `rows` rows: one launch instead of about a hundred.

    Batches of another size, such as the last of a section, use the plain update. The graph reads the batch
    and the optimiser's numbers from fixed memory, which is filled before each replay. The dropout generator
    is registered with the graph, so it advances and can be seeded as usual.
    """

    def __init__(self, step: TrainingStep, adam: Adam, rows: int, kept: Sequence[slice] = ()) -> None:
        super().__init__(step, adam, kept)
        flat, columns = adam.network.flat, (adam.network.inputs, adam.network.outputs)
        self.x, self.y = (torch.zeros(rows, size, device=flat.device) for size in columns)
        self.p = torch.zeros(rows, device=flat.device)
        self.numbers = torch.zeros(len(adam.step_factors(0.0)), dtype=torch.float32, device=flat.device)
        self.graph = torch.cuda.CUDAGraph()
        self.graph.register_generator_state(step.generator)
        before = [tensor.clone() for tensor in (flat, adam.first, adam.second)]
        side_stream = torch.cuda.Stream()
        side_stream.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(side_stream):
            for _ in range(WARM_UP):
                self._once()
        torch.cuda.current_stream().wait_stream(side_stream)
        with torch.cuda.graph(self.graph):
            self.loss = self._once()
        self.error = step.error
        for tensor, value in zip((flat, adam.first, adam.second), before, strict=True):
            tensor.copy_(value)

    def _once(self) -> Tensor:
        loss = self.step(self.x, self.y, self.p, self.masks(len(self.p)))
        self.adam.step_with_torch(self.step.gradients, self.numbers)
        return loss

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, share: float, total: int | None = None) -> Tensor:
        """See `Update.__call__`."""
        if len(p) != len(self.p):
            return super().__call__(x, y, p, share)
        self.x.copy_(x)
        self.y.copy_(y)
        self.p.copy_(p)
        self.adam.steps += 1
        self.numbers.copy_(torch.tensor(self.adam.step_factors(share)), non_blocking=True)
        self.graph.replay()
        self.step.error = self.error  # a plain update may have replaced it
        return self.loss.clone()


def update_for(
    step: TrainingStep, adam: Adam, rows: int, processes: Processes = ALONE, kept: Sequence[slice] = ()
) -> Update:
    """The update to use: captured on CUDA for small batches of one process, where it is faster."""
    if not processes.alone:
        return SharedUpdate(step, adam, processes, rows, kept)
    if adam.network.flat.device.type == "cuda" and rows <= CAPTURED_UP_TO:
        return CapturedUpdate(step, adam, rows, kept)
    return Update(step, adam, kept)
