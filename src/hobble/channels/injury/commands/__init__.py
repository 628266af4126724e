"""Subcommands of `hobble` for injuries."""

from hobble.channels.injury.commands import injury, study

COMMANDS = {"injury": injury, "study": study}
