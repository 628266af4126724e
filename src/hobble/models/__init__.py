"""The kinds of network, one folder each; this folder holds what they share.

Every subfolder with an `__init__.py` is a kind. So there is no list to edit for a new kind, and the
fingerprints of existing rules do not change.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hobble.models.model import Model

if TYPE_CHECKING:
    from hobble.models.options import Options

# The values of `network.kind` in a configuration.
MODELS = tuple(sorted(path.parent.name for path in Path(__file__).parent.glob("*/__init__.py")))
DEFAULT = "pfnn"


def model(kind: str) -> Model:
    """The `Model` of the kind named `kind`, one of MODELS."""
    return importlib.import_module(f"hobble.models.{kind}").MODEL


def network_options(section: Mapping[str, Any]) -> Options:
    """The options of a configuration's section `network`, in the type of its kind.

    It is not called `options`, because that is a module of this package.
    """
    return model(section.get("kind", DEFAULT)).options().model_validate(section)
