"""The interface of a kind of network: its options, and what training or building makes of them.

X are the inputs of a network and Y its outputs. A row is the X and Y of one frame. This module, `blend` and
the kinds' own `__init__.py` import neither PyTorch nor numba: checking a configuration needs neither, and a
game that runs a network needs no PyTorch.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from hobble.core.section import Section
from hobble.core.skeleton import Skeleton
from hobble.rows.layout import RowLayout

if TYPE_CHECKING:
    from hobble.models.network import Network


class Options(Section):
    """The keys of a configuration's `network` section, and what the kind makes of them.

    Each kind has one subclass, named `OPTIONS` in its `__init__.py`: of `hobble.models.blend.BlendedOptions`
    for a kind that is trained in passes, of `BuiltOptions` for another.
    """

    modes: ClassVar[tuple[str, ...]] = ("exact",)  # the modes of its networks, see `Network.modes`

    # Whether its rows have columns of local phases, see `hobble.labels.local_phase`.
    uses_local_phases: ClassVar[bool] = False

    kind: str = ""

    network: ClassVar[str] = ""  # the class of its networks that are ready to run, as `pkgutil` names it

    @classmethod
    def network_class(cls) -> type[Network]:
        """The class of the kind's networks that are ready to run. It is imported only now."""
        return pkgutil.resolve_name(cls.network)  # type: ignore[no-any-return]

    @property
    def hidden(self) -> tuple[int, ...]:
        """Units of each hidden layer; () for a kind without layers."""
        return ()

    @property
    def why_not_symmetric(self) -> str:
        """Why a network with these options cannot be trained with `training.symmetric`; "" if it can.

        With this key of a configuration, the network treats left and right alike.
        """
        return f"a network of kind {self.kind} cannot treat left and right alike"


class BuiltOptions(Options):
    """Options of a kind that is built from the training clips' rows, in order of time, without passes."""

    def build(self, clips: Sequence[str | Path], layout: RowLayout, skeleton: Skeleton) -> FinishedNetwork:
        """Build a network.

        clips: the files with the clips' rows (`hobble.rows.clip_rows`). layout: the columns of X and Y, which
        may have fewer channels than these files. Raises InputError if a file does not fit the layout.
        """
        raise NotImplementedError


@dataclass(frozen=True)
class FinishedNetwork:
    """The result of training or building, ready to be written to a file.

    kind: the name of its kind, and of the kind's folder in hobble.models. arrays: those of its file, from
    which `Network.read` builds the network. description: its size in a few words; a training resumes only
    from a checkpoint with the same words. meta: its entries in the file's `meta`, as data for JSON.
    """

    kind: str
    arrays: dict[str, np.ndarray] = field(repr=False)
    description: str
    meta: dict[str, Any] = field(default_factory=dict, repr=False)
