"""Finds the subcommands of `hobble` that channels add: `COMMANDS` of channels/<name>/commands."""

from __future__ import annotations

import importlib
import importlib.util
from types import ModuleType

from hobble.channels import NAMES


def channel_commands() -> dict[str, ModuleType]:
    """Subcommand -> module with a docstring, `add_arguments(parser)` and `run(options)`, of all channels."""
    found: dict[str, ModuleType] = {}
    for name in NAMES:
        module = f"hobble.channels.{name}.commands"
        if importlib.util.find_spec(module) is not None:
            found |= importlib.import_module(module).COMMANDS
    return found
