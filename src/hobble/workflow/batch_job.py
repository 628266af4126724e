"""Runs a job that makes the files of one clip after another.

Files that an earlier try finished are not made again. A bad clip does not stop the others.
"""

from __future__ import annotations

import errno
import logging
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hobble.core.errors import InputError
from hobble.workflow import checksums
from hobble.workflow.clip_batches import family_of
from hobble.workflow.job import JobLog, checked, reporting
from hobble.workflow.kept_files import KeptFiles, fingerprint

# Disk full, quota used up, disk read-only: errors that would stop every other clip, too.
DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)


@dataclass(frozen=True)
class JobPiece:
    """A piece of a job's work: usually a clip and its mirror.

    name: the clip's name. params: the params of the rule and of this clip. input: name of each input -> the
    piece's file, or a list of files for an input in `files_per_clip` (see `pieces`). output: name of each
    output -> the piece's file.
    """

    name: str
    params: Mapping[str, Any]
    input: Mapping[str, Any]
    output: Mapping[str, str]

    @property
    def files(self) -> list[str]:
        """All input files, ordered by the names of the inputs."""
        found = [
            [files] if isinstance(files, str) else list(files) for _, files in sorted(self.input.items())
        ]
        return [file for files in found for file in files]


def pieces(snakemake: Any) -> list[JobPiece]:
    """The pieces of a job.

    params.per_clip: a list with the params of each piece; the param `clip` is the piece's name.
    params.files_per_clip (optional): name of an input -> list with the number of files of each piece. All
    other inputs, and all outputs, have one file for each piece, or one for all pieces. An input or output
    without files is left out.
    """
    special = ("per_clip", "files_per_clip")
    common = {name: value for name, value in snakemake.params.items() if name not in special}
    per_clip, counts = snakemake.params.per_clip, snakemake.params.get("files_per_clip", {})
    inputs = {
        name: _distributed(_as_list(files), len(per_clip), counts.get(name))
        for name, files in snakemake.input.items()
    }
    outputs = {name: _distributed(_as_list(files), len(per_clip)) for name, files in snakemake.output.items()}
    return [
        JobPiece(
            params["clip"],
            {**common, **params},
            {name: files[n] for name, files in inputs.items() if files},
            {name: files[n] for name, files in outputs.items() if files},
        )
        for n, params in enumerate(per_clip)
    ]


def make_each(snakemake: Any, make: Callable[[JobPiece, logging.Logger], None]) -> None:
    """Call `make` for each piece of a job, except where undamaged files are kept from an earlier try.

    If a piece fails, its error is reported and the other pieces are still made, unless the disk is full or
    read-only. At the end of a job with a failed piece, the process exits with status 1, and Snakemake deletes
    the job's outputs. The next try takes the kept files.
    """
    with reporting(snakemake) as report:
        checksums.forget(snakemake.output)
        # A family is the rules that make the same kind of file, of all data sets and batches.
        kept, digests = KeptFiles(family_of(snakemake.rule)), _Digests()
        all_pieces = pieces(snakemake)
        taken = failed = 0
        for piece in all_pieces:
            try:
                taken += _make_piece(piece, make, kept, digests, report)
            except Exception as error:
                report.error(error)
                failed += 1
                if _is_of_disk(error):
                    break
        if len(all_pieces) > 1 or taken:
            report.logger.info(
                "%d pieces, %d of them kept from before, %d failed", len(all_pieces), taken, failed
            )
        if failed:
            sys.exit(1)


def _make_piece(
    piece: JobPiece,
    make: Callable[[JobPiece, logging.Logger], None],
    kept: KeptFiles,
    digests: _Digests,
    report: JobLog,
) -> bool:
    """Make a piece, or take its kept files. Returns whether kept files were taken."""
    outputs, began = list(piece.output.values()), time.monotonic()
    with checked(piece.files, outputs):
        key = fingerprint(piece.params, digests.of(piece.files), outputs)
        if kept.restore(key, outputs):
            return True
        report.logger.info("%s:", piece.name)
        make(piece, report.logger)
    kept.keep(key, outputs, time.monotonic() - began)
    return False


class _Digests:
    """Names and SHA-256 of files. A file that several pieces need is read only once."""

    def __init__(self) -> None:
        self.computed: dict[tuple[str, checksums.Stamp], str] = {}

    def of(self, files: list[str]) -> list[tuple[str, str]]:
        found = []
        for file, stamp in checksums.stamps(files).items():
            if (file, stamp) not in self.computed:
                self.computed[file, stamp] = _sha256(file)
            found.append((Path(file).name, self.computed[file, stamp]))
        return found


def _sha256(file: str) -> str:
    try:
        return checksums.file_sha256(file)
    except OSError:
        return "cannot be read"  # the job that reads it reports why


def _as_list(files: Any) -> list[str]:
    return [files] if isinstance(files, str) else list(files)


def _distributed(files: list[str], pieces: int, counts: list[int] | None = None) -> list[Any]:
    """For each piece its file or, with `counts`, its list of files; [] if there are no files at all.

    counts: number of files of each piece.
    """
    if counts is not None:
        assert sum(counts) == len(files), f"{len(files)} files, but files_per_clip adds up to {sum(counts)}"
        starts = [sum(counts[:n]) for n in range(pieces)]
        return [files[start : start + count] for start, count in zip(starts, counts, strict=True)]
    if len(files) == 1:
        return files * pieces
    assert len(files) in (0, pieces), f"{len(files)} files for {pieces} pieces: {files}"
    return files


def _is_of_disk(error: Exception) -> bool:
    cause = error.__cause__ if isinstance(error, InputError) else error
    return isinstance(cause, OSError) and cause.errno in DISK_ERRORS
