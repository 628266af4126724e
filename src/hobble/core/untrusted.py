"""Reads bytes, text and YAML from files that may be hostile, with limits on size and depth."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hobble.core.errors import InputError

if TYPE_CHECKING:
    import yaml

MB = 1 << 20  # bytes
MAX_TEXT_BYTES = 64 * MB  # enough for a label file of ten minutes at 100 Hz with 1 kB for each frame
MAX_YAML_BYTES = 4 * MB  # enough for a data set of 20,000 clips with five keys each
MAX_YAML_DEPTH = 100  # levels of lists and mappings within each other
MAX_YAML_VALUES = 1_000_000  # in a file; so many take about 100 MB of memory
LONGEST_INTEGER = 40  # characters; Python refuses to print a number of more than 4,300 digits


def check_regular(path: str | Path) -> os.stat_result:
    """The stat result of a regular file, or of the file that a link points to.

    Raises InputError for a folder, a device or a pipe, because reading from a device or a pipe may never end.
    Raises OSError if there is no such file.
    """
    status = os.stat(path)
    if not stat.S_ISREG(status.st_mode):
        raise InputError(
            path, "not a file" if stat.S_ISDIR(status.st_mode) else "a device or a pipe, not a file"
        )
    return status


def printable(text: object, most: int = 200) -> str:
    """Untrusted text, made safe for a terminal: one line, with "?" for each control character.

    After `most` characters it is cut off with "...".
    """
    plain = "".join(c if c.isprintable() else "?" for c in str(text)[: most + 1])
    return plain if len(plain) <= most else f"{plain[:most]}..."


def read_bytes(path: str | Path, most: int) -> bytes:
    """The content of a regular file of at most `most` bytes.

    Raises InputError if it is missing, unreadable, too large, or not a regular file, or if its size changes
    while it is read.
    """
    try:
        size = check_regular(path).st_size
        with open(path, "rb") as file:
            # read(n) allocates n bytes, so n is not `most` but the file's size, + 1 to see if it grew.
            data = file.read(size + 1) if size <= most else b""
    except FileNotFoundError:
        raise InputError(path, "no such file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(path, f"cannot be read: {reason}") from None
    if size > most:
        raise InputError(path, f"larger than {most / MB:g} MB, the limit for such a file")
    if len(data) != size:
        raise InputError(path, "its size changed while it was read", fix="Try again when it is complete.")
    return data


def read_text(path: str | Path, most: int = MAX_TEXT_BYTES) -> str:
    """The content of a UTF-8 text file, without a byte order mark.

    most: largest number of bytes. Raises InputError if the file is missing, too large or not UTF-8.
    """
    try:
        return read_bytes(path, most).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(path, "not a text file in UTF-8") from None


def read_yaml(path: str | Path) -> Any:
    """The content of a YAML file as plain data.

    Raises InputError, with the line if it is known, for invalid YAML, tags that would create Python objects,
    aliases (`*name`, with which a small file can stand for a huge one), duplicate keys, integers of many
    digits, nesting deeper than MAX_YAML_DEPTH, and more than MAX_YAML_VALUES values.
    """
    import yaml  # imported here because most jobs do not need it

    text = read_text(path, MAX_YAML_BYTES)
    loader_class = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    loader = loader_class(text)
    try:
        _check_events(path, yaml.parse(text, loader_class))
        node = loader.get_single_node()
        if node is None:
            return None
        _check_node(path, node)
        return loader.construct_document(node)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else None
        raise InputError(path, f"not valid YAML: {error.problem}", line=line) from None
    except (yaml.YAMLError, ValueError) as error:  # ValueError: a date such as 2001-99-99
        raise InputError(path, f"not valid YAML: {printable(error)}") from None
    finally:
        loader.dispose()


def _check_events(path: str | Path, events: Iterable[yaml.Event]) -> None:
    """Check what could use up the memory, or crash libyaml, which recurses into lists and mappings."""
    import yaml

    depth = 0
    for number, event in enumerate(events):
        line = event.start_mark.line + 1 if event.start_mark else None
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_YAML_DEPTH:
            raise InputError(path, f"nested deeper than {MAX_YAML_DEPTH} levels", line=line)
        if number > MAX_YAML_VALUES:
            raise InputError(path, f"has more than {MAX_YAML_VALUES} values")
        if isinstance(event, yaml.AliasEvent):
            problem, fix = f"*{event.anchor:.40} is an alias", "Write out what it stands for."
            raise InputError(path, problem, line=line, fix=fix)


def _check_node(path: str | Path, node: yaml.Node) -> None:
    """Raise InputError for a duplicate key, of which YAML's loader would take the last, or a huge integer."""
    line = node.start_mark.line + 1
    if node.tag == "tag:yaml.org,2002:int" and len(node.value) > LONGEST_INTEGER:
        raise InputError(path, f"an integer of {len(node.value)} characters", line=line)
    lines: dict[tuple[str, str], int] = {}  # (type, text) of a key -> its line, from 1
    for child in node.value if isinstance(node.value, list) else ():
        parts = child if isinstance(child, tuple) else (child,)  # a key and its value, or an item
        for part in parts:
            _check_node(path, part)
        if len(parts) == 2 and isinstance(parts[0].value, str):
            name, line = (parts[0].tag, parts[0].value), parts[0].start_mark.line + 1
            if name in lines:
                problem = f"the key {name[1]:.80} is given twice, first in line {lines[name]}"
                raise InputError(path, problem, line=line, fix="Keep one of them.")
            lines[name] = line
