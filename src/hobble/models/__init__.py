"""The kinds of network, one folder each; this folder holds what they share.

Every subfolder with an `__init__.py` is a kind. So a new kind needs no entry in a list, and because no
existing file changes, Snakemake does not repeat existing jobs.
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
DEFAULT = "pfnn"  # the kind if a configuration or a network's file names none


def model(kind: str) -> Model:
    """The `Model` of the kind named `kind`, one of MODELS."""
    return importlib.import_module(f"hobble.models.{kind}").MODEL


def network_options(section: Mapping[str, Any]) -> Options:
    """The options of a configuration's section `network`, in the class of options of its kind.

    The function is not called `options`, because a module of this package has this name.
    """
    return model(section.get("kind", DEFAULT)).options().model_validate(section)
