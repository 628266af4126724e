"""The interface of a kind of network, such as pfnn, for training and loading.

X are the inputs of a network and Y its outputs. A row is the X and Y of one frame.
"""

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
        """Name of its kind, and of the kind's folder in hobble.models."""

    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays of its file; `Model.read` builds the network from them."""

    @property
    def file_metadata(self) -> dict[str, Any]:
        """Its entries in the file's metadata, as data for JSON."""

    @property
    def description(self) -> str:
        """Its size in a few words."""


class Model(ABC):
    """One kind of network. Its folder in hobble.models has an instance `MODEL`.

    `MODEL` is a `TrainedModel` or a `BuiltModel`. The methods import pydantic, PyTorch and numba only when
    they need them. So a game that runs a network needs no PyTorch, and checking a configuration needs neither
    PyTorch nor numba.
    """

    modes: ClassVar[tuple[str, ...]] = ("exact",)  # the modes of its networks, see `Network.modes`

    @abstractmethod
    def options_class(self) -> type[Options]:
        """The keys of a configuration's `network` section."""

    @abstractmethod
    def read(self, path: str | Path, arrays: Mapping[str, Any], shared_fields: Mapping[str, Any]) -> Network:
        """The network of a file.

        path: the file, for error messages. arrays: those of the file, by name, as `FinishedNetwork.arrays`
        returned them. shared_fields: the fields that the networks of all kinds have, those of
        `hobble.models.network.Network`, by name, already checked. Raises InputError for arrays that make no
        network; `hobble.models.checks` has functions for these checks.
        """

    def read_folder(self, folder: Path) -> Mapping[str, np.ndarray] | None:
        """The arrays of a folder in another program's format; None if it holds no network of this kind."""
        return None


class TrainedModel(Model):
    """A kind of network that is trained in passes over the shuffled rows of all training clips."""

    @abstractmethod
    def parameter_count(self, options: Any, inputs: int, outputs: int) -> int:
        """The number of trained parameters, for X of `inputs` columns and Y of `outputs` columns."""

    @abstractmethod
    def untrained_network(self, options: Any, layout: RowLayout, skeleton: Skeleton, seed: int) -> Trainable:
        """A new, untrained network on the CPU. The same seed gives the same network.

        layout: the columns of X and Y, with the joints of `skeleton`.
        """


class BuiltModel(Model):
    """A kind of network without training. It is built from the training clips' rows, in order of time."""

    @abstractmethod
    def build(
        self, options: Any, clips: Sequence[str | Path], layout: RowLayout, skeleton: Skeleton
    ) -> FinishedNetwork:
        """Build a network.

        clips: the files with the clips' rows (`hobble.rows.clip_rows`). layout: the columns of X and Y, which
        may have fewer channels than these files. Raises InputError if a file does not fit the layout.
        """
