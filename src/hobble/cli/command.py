"""What the subcommands of `hobble` have in common: options for reading BVH files, JSON, a bar of progress."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from hobble.config.load_configuration import validate
from hobble.core.clip_files import clips_in
from hobble.core.errors import HobbleError, keep_traceback
from hobble.core.messages import group_messages, in_words
from hobble.motion.options import ClipMotion
from hobble.motion.other_formats import MOTION_SUFFIXES

MOTION_KEYS = tuple(name for name in ClipMotion.model_fields if name not in ("fps", "frames"))
Message = tuple[str, str]  # one of KINDS, and a sentence
KINDS = ("warning", "doubt", "repair", "found", "note")  # of messages about clips, the worst first


@dataclass(frozen=True)
class Command:
    """A subcommand. Its help text is the docstring of `run`.

    group: the heading under which `hobble --help` lists it. add_arguments: adds its arguments to a parser.
    run: runs it with the parsed arguments and returns the exit status.
    """

    group: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], int]


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add the option for output that a program reads."""
    parser.add_argument("--json", action="store_true", help="print the result as JSON, for a program")


def print_result(options: argparse.Namespace, data: Any, text: str) -> None:
    """Print a result: with --json the data, else the text."""
    print(json.dumps(data, indent=1, ensure_ascii=False) if options.json else text)


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


def add_folders(parser: argparse.ArgumentParser, out: str) -> None:
    """Add the arguments of a command that makes files from each clip of a folder. out: help text of OUT."""
    parser.add_argument("folder", type=Path, help="a folder of BVH, glTF or FBX files, or one file")
    parser.add_argument("out", type=Path, help=out)
    add_json(parser)
    add_motion_options(parser)


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
