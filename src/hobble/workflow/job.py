"""What every job's script runs in: a log, clear errors, and clips that are made one after another.

`job` is for a script that makes one thing, `make_each` for one that makes the files of a batch of clips.
"""

from __future__ import annotations

import contextlib
import errno
import functools
import hashlib
import json
import logging
import os
import shutil
import sys
import time
import traceback
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hobble.core.clip_files import MIRROR_SUFFIX, original
from hobble.core.errors import HobbleError, InputError, unforeseen
from hobble.core.files import failed_write_error, write_text
from hobble.workflow.fingerprint import stamp
from hobble.workflow.lifetime import ends_with_run

# The disk is full, a quota is used up, or the disk is read-only. Every other clip would fail, too.
DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)
CLOCK_TICK = 0.02  # seconds; two writes that are this far apart get different modification times
DELETE = "Delete"  # with this word begins every advice to delete a damaged file
RECORDS = ".made"  # folder in that of a data set; see `make_each`


@contextlib.contextmanager
def job(snakemake: Any) -> Iterator[logging.Logger]:
    """Run a script with a log and clear errors. If the run of Snakemake ends, the script ends, too.

    snakemake: the object that Snakemake gives to scripts. Yields the logger. Every message goes to the job's
    log file, warnings and errors also to the terminal. Every error ends the process with status 1, also an
    input file that changes while the script reads it: otherwise its result would count as up to date.
    """
    with _logged(snakemake) as log:
        before = _stamps(map(str, getattr(snakemake, "input", ())))
        yield log.logger
        _check_unchanged(before)


class Inputs:
    """Finds a job's input files by their names, wherever Snakemake has put them.

    A file that a rule names has the name that it has there. A file in the folder of a batch is called as in
    the folder of the data set, such as motion/walk.npz.
    """

    def __init__(self, paths: Iterable[str]) -> None:
        self.files: dict[str, str] = {}
        for path in map(str, paths):
            if os.path.isdir(path):
                for folder, _, names in os.walk(path):
                    within = os.path.relpath(folder, path)
                    self.files.update({os.path.normpath(f"{within}/{n}"): f"{folder}/{n}" for n in names})
            else:
                self.files[path] = path

    def __call__(self, name: str) -> str:
        """The path of a file. Raises InputError if no job has made it."""
        if name in self.files:
            return self.files[name]
        # Files of an object store lie in another folder.
        for path in self.files.values():
            if path.endswith(f"/{name}"):
                return path
        fix = "Delete that folder in batches/; the same command makes it again."
        raise InputError(name, "is missing in the folder of its batch", fix=fix)

    def each(self, name: str, clips: Iterable[str]) -> dict[str, str]:
        """Clip -> path of its file. name: contains {clip}."""
        return {clip: self(name.replace("{clip}", clip)) for clip in clips}


@dataclass(frozen=True)
class Piece:
    """A clip, with what is needed to make its files.

    name: of the clip. params: those of the rule and of this clip. input: name -> path, or a list of paths.
    output: name -> path.
    """

    name: str
    params: Mapping[str, Any]
    input: Mapping[str, Any]
    output: Mapping[str, str]


def make_each(
    snakemake: Any,
    make: Callable[[Piece, logging.Logger], None],
    *,
    reads: Mapping[str, str] | None = None,
    writes: Mapping[str, str],
    after: Callable[[logging.Logger], None] = lambda log: None,
) -> None:
    """Make the files of each clip of a batch, except those that are there already and still right.

    The files get their places in the folder of the data set, such as motion/walk.npz, and stay there if the
    job fails. Its output is the folder of the batch, with links to them. (Snakemake removes a job's outputs
    before it runs and after it fails, so finished clips cannot be kept in there.) A record in .made/<rule>/
    says of what the files were made: a hash of params and inputs, the files' checksums, and the seconds. The
    folder .made can be deleted at any time. The next jobs then make the files again.

    If a clip fails, its error is reported and the others are still made, unless the disk is full. Then the
    process ends with status 1.

    make: makes the files of a clip. reads, writes: name in `Piece.input` and `output` -> the file's name in
    the folder of the data set. It contains {clip}, {original} or, for a file that only clips with mirrors
    have, {mirror}; and {channel} for the clip's own channel, or {channels} for a list, one for each channel
    in the param `channels`. Params: `clips` is a list of mappings with the params of each clip; `files` in it
    maps names to further input files. `mirrored` says whether there are mirrors. Inputs of the rule that are
    called neither `batches` nor `files` are inputs of each clip. after: is called after the last clip.
    """
    with _logged(snakemake) as log:
        folder = Path(snakemake.output.batch)
        folder.mkdir(parents=True, exist_ok=True)
        maker = _Maker(snakemake, make, reads or {}, writes, folder)
        kept = failed = 0
        for params in snakemake.params.clips:
            try:
                kept += maker.make(params, log.logger)
            except Exception as error:
                log.error(error, f"{params['clip']}: ")
                failed += 1
                cause = error.__cause__ if isinstance(error, InputError) else error
                if isinstance(cause, OSError) and cause.errno in DISK_ERRORS:
                    break
        count = len(snakemake.params.clips)
        after(log.logger)
        log.logger.info("%d pieces, %d of them kept from before, %d failed", count, kept, failed)
        if failed:
            sys.exit(1)


class _Maker:
    """Makes the clips of one job of `make_each`."""

    def __init__(
        self, snakemake: Any, make: Any, reads: Mapping[str, str], writes: Mapping[str, str], folder: Path
    ) -> None:
        self.make_files, self.reads, self.writes, self.folder = make, reads, writes, folder
        self.root = folder.parents[2]  # the folder of the data set
        self.records = self.root / RECORDS / Path(snakemake.log[0]).parent.name
        params, inputs = dict(snakemake.params.items()), dict(snakemake.input.items())
        self.params = {name: params[name] for name in params if name not in ("clips", "contents")}
        self.shared = {name: inputs[name] for name in inputs if name not in ("batches", "files")}
        self.inputs = Inputs(snakemake.input)

    def make(self, own: Mapping[str, Any], log: logging.Logger) -> bool:
        """Make the files of one clip. Returns whether they were there already."""
        began = time.monotonic()
        params = {**self.params, **{name: value for name, value in own.items() if name != "files"}}
        named = {**own.get("files", {}), **_names(self.reads, params)}
        found = {
            name: [self.inputs(f) for f in value] if isinstance(value, list) else self.inputs(value)
            for name, value in named.items()
        }
        writes = _names(self.writes, params)
        output = {name: str(self.root / file) for name, file in writes.items()}
        piece = Piece(params["clip"], params, {**self.shared, **found}, output)
        paths = [path for value in piece.input.values() for path in _as_list(value)]
        before = _stamps(paths)
        key = self._key(piece, before, writes)
        record = self.records / f"{next(iter(writes.values()))}.json"
        kept = _is_made(record, key, output.values())
        if not kept:
            for path in (record, *map(Path, output.values())):
                path.unlink(missing_ok=True)  # a clip that fails leaves no older file
            log.info("%s:", piece.name)
            self.make_files(piece, log)
            _check_unchanged(before)
            checks = [_crc32(path) for path in output.values()]
            seconds = round(time.monotonic() - began, 3)
            write_text(record, json.dumps({"key": key, "files": checks, "seconds": seconds}))
        for file in writes.values():
            _give_second_name(self.root / file, self.folder / file)
        return kept

    def _key(self, piece: Piece, stamps: Mapping[str, Any], writes: Mapping[str, str]) -> str:
        """Hash of everything on which the files of a clip depend."""
        inputs = {
            name: [(Path(path).name, _digest(path, stamps.get(path))) for path in _as_list(value)]
            for name, value in piece.input.items()
        }
        text = json.dumps([dict(piece.params), inputs, dict(writes)], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


@functools.cache
def _digest(path: str, stamp: Any) -> str:
    """SHA-256 of a file. A file that several clips need is read once. stamp: differs after each change."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return "cannot be read"  # no error here: what reads the file says why


def _names(patterns: Mapping[str, str], params: Mapping[str, Any]) -> dict[str, Any]:
    """Name -> name of a file, or list of names, from patterns as in `make_each`."""
    clip = params["clip"]
    out: dict[str, Any] = {}
    words = {"clip": clip, "original": original(clip), "mirror": clip + MIRROR_SUFFIX}
    for name, pattern in patterns.items():
        if "{channels}" in pattern:
            out[name] = [pattern.format(**words, channels=channel) for channel in params["channels"]]
        elif "{mirror}" not in pattern or params.get("mirrored"):
            out[name] = pattern.format(**words, channel=params.get("channel", ""))
    return out


def _as_list(files: Any) -> list[str]:
    return [files] if isinstance(files, str) else list(files)


def _is_made(record: Path, key: str, paths: Iterable[str]) -> bool:
    """Whether a record says that these files were made of this, and they are undamaged."""
    try:
        found = json.loads(record.read_text(encoding="utf-8"))
        return bool(found["key"] == key and found["files"] == [_crc32(path) for path in paths])
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _crc32(path: str) -> int:
    return zlib.crc32(Path(path).read_bytes())


def _give_second_name(source: Path, target: Path) -> None:
    """Link a file, which takes no space, or copy it where the file system has no hard links."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.unlink(missing_ok=True)
        try:
            os.link(source, target)
        except PermissionError:
            shutil.copyfile(source, target)
    except OSError as error:
        raise failed_write_error(error, target) from error


def _stamps(paths: Iterable[str]) -> dict[str, tuple[int, ...]]:
    """Path -> `hobble.workflow.fingerprint.stamp`, for those of the files that exist."""
    out = {}
    for path in paths:
        if os.path.isfile(path):
            # Wait if the file was written just now, because another write could get the same time.
            if 0 <= time.time() - os.stat(path).st_mtime < CLOCK_TICK:
                time.sleep(CLOCK_TICK)
            out[path] = tuple(stamp(path))
    return out


def _check_unchanged(before: Mapping[str, Any]) -> None:
    """Raise InputError for a file that was changed, replaced or deleted since `_stamps` returned `before`."""
    now = _stamps(before)
    for path, earlier in before.items():
        if now.get(path) != earlier:
            raise InputError(path, "changed while it was being read", fix="Run the same command again.")


@contextlib.contextmanager
def _logged(snakemake: Any) -> Iterator[_Log]:
    """Run a script with a log. An error is reported and ends the process with status 1."""
    log = _Log(str(snakemake.log[0]), snakemake.rule, list(map(str, getattr(snakemake, "input", ()))))
    try:
        with ends_with_run():
            yield log
    except Exception as error:
        log.error(error)
        sys.exit(1)
    finally:
        logging.shutdown()


class _Log:
    """Writes a job's messages to its log file, and warnings and errors also to the terminal.

    path: the log file. rule: name of the rule, with which each message on the terminal begins. inputs: the
    paths of the job's input files and folders.
    """

    def __init__(self, path: str, rule: str, inputs: list[str]) -> None:
        self.path, self.inputs = path, inputs
        # Messages reach the terminal even if the log cannot be written, as on a full disk.
        logging.raiseExceptions = False
        try:
            os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
            file_handler: logging.Handler = logging.FileHandler(path, "w", encoding="utf-8")
        except OSError:
            file_handler = logging.NullHandler()
        self.logger = logging.getLogger("hobble")
        self.logger.setLevel(logging.INFO)
        file_handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
        terminal = logging.StreamHandler(sys.stderr)
        terminal.setLevel(logging.WARNING)
        # On a terminal, each message first clears the line of progress, which Snakemake's process prints.
        clear = "\r\x1b[K" if sys.stderr.isatty() else ""
        terminal.setFormatter(logging.Formatter(f"{clear}{rule}: %(message)s"))
        self.logger.handlers = [file_handler, terminal]
        logging.captureWarnings(True)

    def error(self, error: Exception, what: str = "") -> None:
        """Log an error. what: the clip that failed.

        The log file also gets the traceback, except for a lack of memory and for a HobbleError, whose message
        says everything that a user needs.
        """
        if isinstance(error, HobbleError):
            self.logger.error("%s", with_true_advice(error, self.inputs))
        elif isinstance(error, MemoryError):
            self.logger.error("out of memory. Give the job more memory, or use a smaller data set or batch.")
        else:
            if isinstance(error, OSError):  # a full disk or a missing permission that nothing has explained
                path, reason = error.filename or "a file", error.strerror or error
                self.logger.error("%s: %s. See %s", path, reason, self.path)
            else:
                self.logger.error("%s%s", what, unforeseen(error, self.path))
            self.logger.info("%s", "".join(traceback.format_exception(error)))  # only to the file


def with_true_advice(error: HobbleError, inputs: Iterable[str]) -> HobbleError:
    """The error with advice that helps in a run, if its advice was to delete a damaged file.

    A rule makes its whole output again only if all of it is gone, and the output may be a folder. A file that
    no rule has made must be replaced. inputs: the paths of the job's input files and folders.
    """
    if not isinstance(error, InputError) or DELETE not in (error.fix or ""):
        return error
    path = os.path.normpath(error.path)
    made = [given for given in inputs if "results/" in given and f"{path}/".startswith(f"{given}/")]
    if not made and "results/" in path:
        return error
    fix = f"Delete {made[0]}; the same command makes it again." if made else "Replace it by a good copy."
    return InputError(error.path, error.problem, line=error.line, frame=error.frame, fix=fix)
