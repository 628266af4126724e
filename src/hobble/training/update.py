"""Updates the weights with one batch: computes the gradient and takes a step of the optimiser.

On CUDA, the update of a small batch is captured as a graph, so that all its kernels start at once.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from hobble.models.trainable import ALL_ROWS, TrainingStep
from hobble.training.optimiser import Adam
from hobble.training.processes import ALONE, Processes

# Updates of batches with at most this many rows are captured. With larger batches, launches of kernels take
# little time compared with matrix products.
CAPTURED_UP_TO = 1024
WARM_UP = 3  # updates before the capture; during these, libraries choose algorithms and allocate memory


class Update:
    """Draws the dropout masks of a batch, computes the gradient and takes a step.

    undropped: blocks of columns of X that dropout never drops, such as channels. A dropped input gets its
    mean value. So if channels were dropped, a hurt body would seem less hurt, and the network would rely less
    on its channels.
    """

    def __init__(self, step: TrainingStep, adam: Adam, undropped: Sequence[slice] = ()) -> None:
        self.step, self.adam, self.undropped = step, adam, undropped

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """Draw the dropout masks of a batch of `rows` rows, and return those of the rows `own`."""
        masks = self.step.masks(rows, own)
        for block in self.undropped:
            masks[self.step.input_mask][:, block] = 1.0
        return masks

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, share: float, total: int | None = None) -> Tensor:
        """Train on x (B, X), y (B, Y) and phases p (B,). Returns the loss, a scalar tensor.

        share: factor of the learning rate. total: rows of the batch over all processes, if there are several.
        """
        loss = self.step(x, y, p, self.masks(len(x)))
        self.adam.step(self.step.gradients, share)
        return loss


class SharedUpdate(Update):
    """The update by several processes. Each process has its own rows of the batch, maybe none.

    The loss is a mean over the rows of the batch. So each process multiplies its gradient and loss by its
    share of the rows. Then the sums over the processes are the gradient and the loss of the whole batch.

    batch: rows of a whole batch.
    """

    def __init__(
        self,
        step: TrainingStep,
        adam: Adam,
        processes: Processes,
        batch: int,
        undropped: Sequence[slice] = (),
    ) -> None:
        super().__init__(step, adam, undropped)
        self.processes, self.own = processes, processes.own_places(batch)
        # One buffer for the gradient and, in its last item, the loss, so that one message sends both.
        self.sent = torch.empty(len(adam.network.flat) + 1, dtype=adam.network.flat.dtype)
        self.sent = self.sent.to(adam.network.flat.device)
        self.gradients = adam.network.views(self.sent[:-1])

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, share: float, total: int | None = None) -> Tensor:
        """See `Update.__call__`. Returns the loss of the whole batch."""
        total = total or len(p)
        masks = self.masks(total, slice(self.own.start, self.own.stop))
        if len(p):
            loss = self.step(x, y, p, masks)
            for to_send, gradient in zip(self.gradients, self.step.gradients, strict=True):
                to_send.copy_(gradient.view(to_send.shape))
            self.sent[-1] = loss
            self.sent.mul_(len(p) / total)
        else:
            self.sent.zero_()
            self.step.error = self.step.error[:0]  # no rows, so no errors
        self.processes.sum(self.sent)
        self.adam.step(self.gradients, share)
        return self.sent[-1].clone()


class CapturedUpdate(Update):
    """The update on a CUDA device for batches of `rows` rows.

    It is captured as a CUDA graph: one launch starts about a hundred kernels. Batches of another size, such
    as the last one of a section, use the plain update. The graph reads the batch and the optimiser's numbers
    from fixed memory, which is filled before each replay. The dropout generator is registered with the graph,
    so it advances and can be seeded as usual.
    """

    def __init__(self, step: TrainingStep, adam: Adam, rows: int, undropped: Sequence[slice] = ()) -> None:
        super().__init__(step, adam, undropped)
        flat, widths = adam.network.flat, (adam.network.inputs, adam.network.outputs)
        self.x, self.y = (torch.zeros(rows, width, device=flat.device) for width in widths)
        self.p = torch.zeros(rows, device=flat.device)
        self.numbers = torch.zeros(len(adam.step_factors(0.0)), dtype=torch.float32, device=flat.device)
        self.graph = torch.cuda.CUDAGraph()
        self.graph.register_generator_state(step.generator)
        # The updates of the warm-up change these tensors, so they are put back below.
        before = [tensor.clone() for tensor in (flat, adam.first_moment, adam.second_moment)]
        side_stream = torch.cuda.Stream()
        side_stream.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(side_stream):
            for _ in range(WARM_UP):
                self._update_from_fixed_memory()
        torch.cuda.current_stream().wait_stream(side_stream)
        with torch.cuda.graph(self.graph):
            self.loss = self._update_from_fixed_memory()
        self.error = step.error
        for tensor, value in zip((flat, adam.first_moment, adam.second_moment), before, strict=True):
            tensor.copy_(value)

    def _update_from_fixed_memory(self) -> Tensor:
        """The operations that are captured. Returns the loss."""
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
    step: TrainingStep, adam: Adam, rows: int, processes: Processes = ALONE, undropped: Sequence[slice] = ()
) -> Update:
    """The fastest update for batches of `rows` rows.

    On CUDA it is captured if there is one process and the batches are small.
    """
    if not processes.is_alone:
        return SharedUpdate(step, adam, processes, rows, undropped)
    if adam.network.flat.device.type == "cuda" and rows <= CAPTURED_UP_TO:
        return CapturedUpdate(step, adam, rows, undropped)
    return Update(step, adam, undropped)
