"""The kinds of network, each in a folder of its own: what is common to them is in this one.

A folder with an `__init__.py` is a kind, so that no list has to be edited to add one, and no rule's
fingerprint changes for those that there are.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hobble.models.model import Model

if TYPE_CHECKING:
    from hobble.models.options import Options

# A configuration names one of them as `network.kind`.
MODELS = tuple(sorted(path.parent.name for path in Path(__file__).parent.glob("*/__init__.py")))
DEFAULT = "pfnn"


def model(kind: str) -> Model:
    """The kind of network `kind`, one of MODELS."""
    return importlib.import_module(f"hobble.models.{kind}").MODEL


def network_options(section: Mapping[str, Any]) -> Options:
    """A configuration's section `network`, of its kind's type.

    Not called `options`: that is a module of this package, which would take its place once it is imported.
    """
    return model(section.get("kind", DEFAULT)).options().model_validate(section)
