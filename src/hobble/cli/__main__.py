"""The command `hobble`. `hobble --help` lists its subcommands."""

from __future__ import annotations

import argparse
import inspect
import sys
from collections.abc import Callable, Sequence
from typing import Any

from hobble.cli.commands import Injury, Labels, Motion, Play
from hobble.core.errors import HobbleError
from hobble.measures import study

COMMANDS: dict[str, Any] = {
    "motion": Motion,
    "labels": Labels,
    "injury": Injury,
    "study": study,
    "play": Play,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand. Returns the exit status: 0, 1 if something failed, or 130 after Ctrl+C.

    arguments: by default those of the command line. With wrong arguments, the process exits with status 2.
    """
    parser = argparse.ArgumentParser(
        prog="hobble",
        description="Converts and labels clips, and opens a trained character. "
        "A Snakemake workflow trains a character from clips: see README.md.",
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, module in COMMANDS.items():
        text = str(inspect.getdoc(module))  # its first line is the entry in the list of subcommands
        command = commands.add_parser(
            name,
            help=text.splitlines()[0],
            description=text,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        module.add_arguments(command)
        command.set_defaults(run=module.run)
    options = parser.parse_args(arguments)
    run: Callable[[argparse.Namespace], int] = options.run
    try:
        return run(options)
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
