"""Finds the subcommands of `hobble` that channels add. A channel lists them in channels/<name>/commands."""

from __future__ import annotations

import importlib
import importlib.util
from types import ModuleType

from hobble.channels import CHANNEL_NAMES


def channel_commands() -> dict[str, ModuleType]:
    """Name of each subcommand of a channel -> the module that implements it.

    The module has a docstring, which becomes the help text, and the functions `add_arguments(parser)` and
    `run(options)`.
    """
    found: dict[str, ModuleType] = {}
    for name in CHANNEL_NAMES:
        module = f"hobble.channels.{name}.commands"
        if importlib.util.find_spec(module) is not None:
            found |= importlib.import_module(module).COMMANDS
    return found
