"""The part of a configuration's `network` section that all kinds of network share."""

from __future__ import annotations

from hobble.core.section import Section


class Options(Section):
    """The keys of a configuration's `network` section; each kind adds its own."""

    kind: str = ""

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
