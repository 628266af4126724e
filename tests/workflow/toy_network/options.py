"""The keys of `network` for kind toy."""

from typing import Literal

from hobble.models.options import Options


class ToyOptions(Options):
    """None but its kind."""

    kind: Literal["toy"] = "toy"
