"""The interface of a kind of network, as training and loading use it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from hobble.core.skeleton import Skeleton
from hobble.rows.layout import RowLayout

if TYPE_CHECKING:
    import numpy as np

    from hobble.models.network import Network
    from hobble.models.options import Options
    from hobble.models.trainable import Trainable


class FinishedNetwork(Protocol):
    """The result of training or building, ready to be written to a file."""

    @property
    def kind(self) -> str:
        """Its folder in hobble.models."""

    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays of its file; `Model.read` builds the network from them."""

    @property
    def about(self) -> dict[str, Any]:
        """Its entries in the file's meta, as JSON."""

    @property
    def described(self) -> str:
        """Its size in a few words."""


class Model(ABC):
    """One kind of network. `MODEL` in its folder is a `Trained` or a `Built`.

    Methods import pydantic, PyTorch and numba only when they need them. So a game needs no PyTorch, and
    checking a configuration needs neither PyTorch nor numba.
    """

    modes: ClassVar[tuple[str, ...]] = ("exact",)  # those of its networks, see `Network.modes`

    @abstractmethod
    def options(self) -> type[Options]:
        """The keys of a configuration's `network` section."""

    @abstractmethod
    def read(self, path: str | Path, arrays: Mapping[str, Any], common: Mapping[str, Any]) -> Network:
        """The network of a file's arrays, as `Trainable.arrays` wrote them.

        common: the fields of `hobble.models.network.Network`, already checked. Raises InputError, with
        `path`, for arrays that cannot run. Use `hobble.models.checks`.
        """

    def read_folder(self, folder: Path) -> Mapping[str, np.ndarray] | None:
        """The arrays of a folder in another program's format, or None if it is not of this kind."""
        return None


class Trained(Model):
    """A kind that is trained in passes over the shuffled rows of a database."""

    @abstractmethod
    def parameters(self, options: Any, inputs: int, outputs: int) -> int:
        """The number of trained parameters, for X of `inputs` columns and Y of `outputs` columns."""

    @abstractmethod
    def trainable(self, options: Any, layout: RowLayout, skeleton: Skeleton, seed: int) -> Trainable:
        """A new, untrained network on the CPU. The same seed gives the same network.

        layout: its columns, with the joints of `skeleton`.
        """


class Built(Model):
    """A kind without training: it is built from the rows of the training clips in their order."""

    @abstractmethod
    def build(
        self, options: Any, clips: Sequence[str | Path], layout: RowLayout, skeleton: Skeleton
    ) -> FinishedNetwork:
        """Build it from the files of rows `clips` (`hobble.rows.clip_rows`).

        layout: of the database, which may have fewer channels than the files. Raises InputError if a file
        does not fit the layout.
        """
