"""The kinds of network. Each kind has a folder here; the modules of this folder itself serve all kinds.

Every subfolder with an `__init__.py` is a kind. A new kind needs no entry in a list, so no existing file
changes, and Snakemake does not repeat the jobs of other kinds.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hobble.models.model import Options

# The values of `network.kind` in a configuration.
NETWORK_KINDS = tuple(sorted(path.parent.name for path in Path(__file__).parent.glob("*/__init__.py")))
DEFAULT_KIND = "pfnn"  # the kind of network where a configuration or a network's file names no kind


def options_of_kind(kind: str) -> type[Options]:
    """The class of options of the kind named `kind`, one of NETWORK_KINDS. They say all about the kind."""
    return importlib.import_module(f"hobble.models.{kind}").OPTIONS


def network_options(section: Mapping[str, Any]) -> Options:
    """A configuration's section `network`, checked and turned into its kind's subclass of `Options`."""
    return options_of_kind(section.get("kind", DEFAULT_KIND)).model_validate(section)
