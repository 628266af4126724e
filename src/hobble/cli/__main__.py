"""The command `hobble`. `hobble --help` lists its subcommands."""

import argparse
import os
import signal
import sys
from collections.abc import Sequence
from importlib.metadata import version

from hobble.cli import characters, clips, gait  # noqa: F401 - they add their commands
from hobble.cli.command import COMMANDS, arg, command
from hobble.core.errors import HobbleError, keep_traceback
from hobble.measures import score

command("BVH files", score.add_arguments, name="score")(score.run)


@command("the shell", arg("shell", choices=("bash", "zsh", "fish")))
def completion(options: argparse.Namespace) -> int:
    """Print a script that completes the command in a shell.

    source <(hobble completion bash)
    hobble completion fish | source
    """
    words = {name: _words_of(parser) for name, parser in _parsers().items()}
    if options.shell == "fish":
        lines = [f"complete -c hobble -n __fish_use_subcommand -a '{' '.join(words)}'"]
        for name, known in words.items():
            lines.append(f"complete -c hobble -n '__fish_seen_subcommand_from {name}' -a '{known}'")
    else:
        # zsh has `complete` after `bashcompinit`.
        lines = ["autoload -U +X bashcompinit && bashcompinit"] if options.shell == "zsh" else []
        lines += ["_hobble() {", '  case "${COMP_WORDS[1]}" in']
        lines += [f'    {name}) words="{known}" ;;' for name, known in words.items()]
        lines += ["    *) words= ;;", "  esac"]
        lines += [f'  [ "$COMP_CWORD" = 1 ] && words="{" ".join(words)} --help --version"']
        lines += ['  COMPREPLY=($(compgen -W "$words" -- "${COMP_WORDS[COMP_CWORD]}"))', "}"]
        lines += ["complete -o default -F _hobble hobble"]
    print("\n".join(lines))
    return 0


def _words_of(parser: argparse.ArgumentParser) -> str:
    """The options of a subcommand and the words that its arguments allow."""
    actions = [action for action in parser._actions if action.help != argparse.SUPPRESS]
    words = [word for action in actions for word in [*action.option_strings, *(action.choices or ())]]
    return " ".join(map(str, words))


def _parsers(parent: argparse.ArgumentParser | None = None) -> dict[str, argparse.ArgumentParser]:
    """Name of each subcommand -> its parser, below `parent`."""
    parent = parent or argparse.ArgumentParser(prog="hobble")
    commands = parent.add_subparsers(
        dest="command", required=True, metavar="COMMAND", help=argparse.SUPPRESS, prog="hobble"
    )
    parsers = {}
    for name, found in COMMANDS.items():
        layout = argparse.RawDescriptionHelpFormatter
        parser = commands.add_parser(name, description=found.text, formatter_class=layout)
        for add in found.arguments:
            add(parser)
        parser.set_defaults(run=found.run)
        parsers[name] = parser
    return parsers


def _description() -> str:
    """What `hobble --help` says: the subcommands with the first line of their texts, in groups."""
    lines = ["Commands for clips and networks. A Snakemake workflow trains a character: see README.md."]
    for group in dict.fromkeys(found.group for found in COMMANDS.values()):
        known = {name: found.text for name, found in COMMANDS.items() if found.group == group}
        lines += ["", f"{group}:", *(f"  {name:12}{text.splitlines()[0]}" for name, text in known.items())]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand. Returns the exit status: 0, 1 if something failed, or 128 plus a signal's number.

    arguments: by default those of the command line. With wrong arguments, the process exits with status 2.
    """
    parser = argparse.ArgumentParser(
        prog="hobble",
        usage="hobble [--help] [--version] COMMAND ...",
        description=_description(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"hobble {version('hobble')}")
    _parsers(parser)
    options = parser.parse_args(arguments)
    try:
        status = int(options.run(options))
        sys.stdout.flush()
        return status
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 1
    except ModuleNotFoundError as error:
        print(f"hobble {options.command} needs {error.name}: pip install 'hobble[workflow]'", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    except BrokenPipeError:  # the reader, such as `head`, has read enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 128 + signal.SIGPIPE
    except Exception as error:
        files = [str(value) for value in vars(options).values() if hasattr(value, "suffix")]
        print(keep_traceback(error, f"hobble {options.command} {' '.join(files)}: "), file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
