"""What a folder of networks says of itself to those who train and load one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hobble.core.skeleton import Skeleton
from hobble.rows.layout import RowLayout

if TYPE_CHECKING:
    import numpy as np

    from hobble.models.network import Network
    from hobble.models.options import Options
    from hobble.models.trainable import Trainable


class Model(ABC):
    """One kind of network: `MODEL` of its folder is one of these.

    What it takes to configure (pydantic), to train (PyTorch) and to run (numba) is imported in the methods
    that need it: a game needs no PyTorch, and a configuration is checked without either.
    """

    @abstractmethod
    def options(self) -> type[Options]:
        """The keys of a configuration's `network` section."""

    @abstractmethod
    def parameters(self, options: Any, inputs: int, outputs: int) -> int:
        """How many numbers are trained, for rows of `inputs` and `outputs` columns."""

    @abstractmethod
    def trainable(self, options: Any, layout: RowLayout, skeleton: Skeleton, seed: int) -> Trainable:
        """A network that has learnt nothing yet, on the CPU; the same seed gives the same one.

        layout: its columns, of the joints of `skeleton`.
        """

    @abstractmethod
    def read(self, path: str | Path, arrays: Mapping[str, Any], common: Mapping[str, Any]) -> Network:
        """The network of a file's arrays, as `Trainable.arrays` wrote them.

        common: the fields of `hobble.models.network.Network`, already checked. Raises InputError, naming
        `path`, for anything that could not run (`hobble.models.checks` helps).
        """

    def read_folder(self, folder: Path) -> Mapping[str, np.ndarray] | None:
        """The arrays of a folder in a format of another program, or None where it is none of this kind's."""
        return None
