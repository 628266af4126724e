"""What a folder of networks says of itself to those who train and load one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from hobble.core.skeleton import Skeleton
from hobble.rows.layout import RowLayout

if TYPE_CHECKING:
    import numpy as np

    from hobble.models.network import Network
    from hobble.models.options import Options
    from hobble.models.trainable import Trainable


class Made(Protocol):
    """What training or building ends with, as it is written into a file."""

    @property
    def kind(self) -> str:
        """Its folder in hobble.models."""

    def arrays(self) -> dict[str, np.ndarray]:
        """What a file holds of it, from which its `Model.read` builds the network."""

    @property
    def about(self) -> dict[str, Any]:
        """What a file's meta says of it, as JSON."""

    @property
    def described(self) -> str:
        """Its size in a few words."""


class Model(ABC):
    """One kind of network: `MODEL` of its folder is a `Trained` or a `Built`.

    What it takes to configure (pydantic), to train (PyTorch) and to run (numba) is imported in the methods
    that need it: a game needs no PyTorch, and a configuration is checked without either.
    """

    @abstractmethod
    def options(self) -> type[Options]:
        """The keys of a configuration's `network` section."""

    @abstractmethod
    def read(self, path: str | Path, arrays: Mapping[str, Any], common: Mapping[str, Any]) -> Network:
        """The network of a file's arrays, as `Trainable.arrays` wrote them.

        common: the fields of `hobble.models.network.Network`, already checked. Raises InputError, naming
        `path`, for anything that could not run (`hobble.models.checks` helps).
        """

    def read_folder(self, folder: Path) -> Mapping[str, np.ndarray] | None:
        """The arrays of a folder in a format of another program, or None where it is none of this kind's."""
        return None


class Trained(Model):
    """A kind that learns from the shuffled rows of a database, pass after pass."""

    @abstractmethod
    def parameters(self, options: Any, inputs: int, outputs: int) -> int:
        """How many numbers are trained, for rows of `inputs` and `outputs` columns."""

    @abstractmethod
    def trainable(self, options: Any, layout: RowLayout, skeleton: Skeleton, seed: int) -> Trainable:
        """A network that has learnt nothing yet, on the CPU; the same seed gives the same one.

        layout: its columns, of the joints of `skeleton`.
        """


class Built(Model):
    """A kind that learns nothing: it is made at once, from the rows of the training clips in their order."""

    @abstractmethod
    def build(self, options: Any, clips: Sequence[str | Path], layout: RowLayout, skeleton: Skeleton) -> Made:
        """What is made of the files of rows `clips` (`hobble.rows.clip_rows`).

        layout: of the database, whose channels may be fewer than those of the files. Raises InputError where
        a file does not fit it.
        """
