"""The keys of `network` for kind toy."""

from typing import Literal

from hobble.models.options import Options


class ToyOptions(Options):
    """The kind of network is the only option."""

    kind: Literal["toy"] = "toy"
