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
# At most this many values in a file, counted after each alias (`*name`) is replaced by what it stands for.
# This number of values takes about 100 MB of memory.
MAX_YAML_NODES = 1_000_000
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
    duplicate keys, nesting deeper than MAX_YAML_DEPTH, and more than MAX_YAML_NODES values.
    """
    import yaml  # imported here because most jobs do not need it

    text = read_text(path, MAX_YAML_BYTES)
    loader_class = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    loader = loader_class(text)
    try:
        _check_depth(yaml.parse(text, loader_class))
        node = loader.get_single_node()
        if node is None:
            return None
        if _expanded_size(node, {}, set()) > MAX_YAML_NODES:
            raise InputError(path, f"has more than {MAX_YAML_NODES} values, with its aliases expanded")
        _check_keys(path, node)
        return loader.construct_document(node)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else None
        raise InputError(path, f"not valid YAML: {error.problem}", line=line) from None
    except RecursionError:
        raise InputError(path, "nested too deeply, or has an alias that contains itself") from None
    except (yaml.YAMLError, ValueError) as error:
        raise InputError(path, f"not valid YAML: {' '.join(str(error).split())}") from None
    finally:
        loader.dispose()


def _check_depth(events: Iterable[yaml.Event]) -> None:
    """Raise RecursionError for too deep nesting. libyaml would recurse into it and crash the process."""
    import yaml

    depth = 0
    for event in events:
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_YAML_DEPTH:
            raise RecursionError


def _check_keys(path: str | Path, top: yaml.Node) -> None:
    """Raise InputError for a duplicate key, of which YAML's loader would take the last, or a huge integer."""
    todo, seen = [top], set()
    while todo:
        node = todo.pop()
        if id(node) in seen or not isinstance(node.value, list):
            continue
        seen.add(id(node))
        todo += _children(node)
        lines: dict[tuple[str, str], int] = {}  # (type, text) of a key -> its line, from 1
        for scalar in _children(node):
            if scalar.tag == "tag:yaml.org,2002:int" and len(scalar.value) > LONGEST_INTEGER:
                problem = f"an integer of {len(scalar.value)} characters"
                raise InputError(path, problem, line=scalar.start_mark.line + 1)
        for key in (child[0] for child in node.value if isinstance(child, tuple)):
            if not isinstance(key.value, str):
                continue  # not a valid key; the loader reports it
            name, line = (key.tag, key.value), key.start_mark.line + 1
            if name in lines:
                problem = f"the key {key.value:.80} is given twice, first in line {lines[name]}"
                raise InputError(path, problem, line=line, fix="Keep one of them.")
            lines[name] = line


def _children(node: yaml.Node) -> list[yaml.Node]:
    """The items of a list, or the keys and values of a mapping."""
    pairs = (child if isinstance(child, tuple) else (child,) for child in node.value)
    return [part for pair in pairs for part in pair]


def _expanded_size(node: yaml.Node, known: dict[int, int], above: set[int]) -> int:
    """Number of values in a node after every alias is replaced by what it stands for.

    known: `id` of each list or mapping counted so far -> its number of values. above: `id`s of the nodes that
    contain `node`. Raises RecursionError for an alias that contains itself.
    """
    if not isinstance(node.value, list):
        return 1
    if id(node) in above:
        raise RecursionError
    if id(node) not in known:
        above.add(id(node))
        known[id(node)] = 1 + sum(_expanded_size(child, known, above) for child in _children(node))
        above.remove(id(node))
    return known[id(node)]
