"""The kinds of network, each in a folder of its own: what is common to them is in this one."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from hobble.models.model import Model

if TYPE_CHECKING:
    from hobble.models.options import Options

# A configuration names one of them as `network.kind`; the first is the default. Each is a folder here.
MODELS = ("pfnn",)


def model(kind: str) -> Model:
    """The kind of network `kind`, one of MODELS."""
    return importlib.import_module(f"hobble.models.{kind}").MODEL


def options(section: Mapping[str, Any]) -> Options:
    """A configuration's section `network`, of its kind's type."""
    return model(section.get("kind", MODELS[0])).options().model_validate(section)
