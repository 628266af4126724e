"""What the subcommands of `hobble` have in common: options for reading BVH files, JSON, a bar of progress."""

import argparse
import inspect
import json
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

from tqdm import tqdm

from hobble.config.load_configuration import validate
from hobble.core.clip_files import clips_in
from hobble.core.errors import HobbleError, keep_traceback
from hobble.core.messages import group_messages, in_words
from hobble.motion import ClipMotion
from hobble.motion.other_formats import MOTION_SUFFIXES

MOTION_KEYS = tuple(name for name in ClipMotion.model_fields if name != "frames")
Message = tuple[str, str]  # one of KINDS, and a sentence
KINDS = ("warning", "doubt", "repair", "found", "note")  # of messages about clips, the worst first


Argument = Callable[[argparse.ArgumentParser], Any]  # adds one argument or several to a parser


class Command(NamedTuple):
    """A subcommand.

    group: the heading under which `hobble --help` lists it, such as "BVH files". run: runs it with the parsed
    arguments and returns the exit status. text: its help.
    """

    group: str
    run: Callable[[argparse.Namespace], int]
    arguments: tuple[Argument, ...]
    text: str


COMMANDS: dict[str, Command] = {}  # filled by `command`


def command(group: str, *arguments: Argument, name: str = "", text: str = "") -> Callable:
    """A decorator that makes a function a subcommand: its name and docstring are those of the subcommand."""

    def register(run: Callable[[argparse.Namespace], int]) -> Callable[[argparse.Namespace], int]:
        COMMANDS[name or run.__name__] = Command(group, run, arguments, text or str(inspect.getdoc(run)))
        return run

    return register


def arg(*names: str, **how: Any) -> Argument:
    """An argument of a subcommand. names, how: as for `ArgumentParser.add_argument`."""
    return lambda parser: parser.add_argument(*names, **how)


JSON = arg("--json", action="store_true", help="print the result as JSON, for a program")
FOLDER = arg("folder", type=Path, help="a folder of BVH, glTF or FBX files, or one file")


def print_result(options: argparse.Namespace, data: Any, text: str) -> None:
    """Print a result: with --json the data, else the text."""
    print(json.dumps(data, indent=1, ensure_ascii=False, default=float) if options.json else text)


def add_motion_options(parser: argparse.ArgumentParser) -> None:
    """Add an option for each key of a data set's section `motion`, with which a file is read."""
    group = parser.add_argument_group("how files are read", "the keys of a data set's section `motion`")
    for name in MOTION_KEYS:
        field = ClipMotion.model_fields[name]
        flag, text = f"--{name.replace('_', '-')}", (field.description or "").replace("%", "%%")
        if field.annotation is bool:
            group.add_argument(flag, action="store_true", default=None, help=text)
        else:
            group.add_argument(flag, metavar="VALUE", help=f"{text} (default {field.default})")


def motion_options(options: argparse.Namespace) -> ClipMotion:
    """The values of the options of `add_motion_options`. Raises HobbleError for a bad value."""
    given = {name: getattr(options, name, None) for name in MOTION_KEYS}
    return validate(ClipMotion, {name: value for name, value in given.items() if value is not None}, "hobble")


def process_clips(options: argparse.Namespace, process: Callable[[str, Path], list[Message]]) -> int:
    """Call `process(name, file)` for every clip. Print errors, then the messages by kind, and a summary.

    If a clip fails, its error message is printed, and the next clip is processed. options: the arguments
    FOLDER and OUT. Returns the exit status: 1 if a clip failed, else 0.
    """
    options.out.mkdir(parents=True, exist_ok=True)
    clips, results = clips_in(options.folder, MOTION_SUFFIXES), []
    messages: list[tuple[str, str, str]] = []
    for name, file in progress(clips.items()):
        found, error = list[Message](), ""
        try:
            found = process(name, file)
        except HobbleError as refused:
            error = str(refused)
        except Exception as bug:
            error = keep_traceback(bug, f"{file}: ")
        results.append({"clip": name, "notes": [sentence for _, sentence in found], "error": error})
        messages += [(name, kind, sentence) for kind, sentence in found]
        if error and not options.json:
            tqdm.write(error)  # begins with the path of the file
    messages.sort(key=lambda message: KINDS.index(message[1]))
    failed = sum(bool(result["error"]) for result in results)
    summary = f"{len(clips) - failed} of {len(clips)} clips done"
    summary += f", {failed} failed: see above" if failed else ""
    print_result(options, results, "\n".join([*map(in_words, group_messages(messages)), summary]))
    return 1 if failed else 0


def progress(items: Iterable[Any]) -> Iterable[Any]:
    """The items, with a bar of progress on standard error if it is a terminal."""
    return tqdm(items, unit=" clips", disable=None, file=sys.stderr)
