"""Runs a job that makes the files of several clips, one clip after another.

Files that an earlier try of the job finished are not made again. If one clip fails, the files of the other
clips are still made.
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
from hobble.workflow.job import JobLog, check_and_record, log_job
from hobble.workflow.kept_files import KeptFiles, fingerprint

# The disk is full, a quota is used up, or the disk is read-only. Every other clip would fail, too.
DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)


@dataclass(frozen=True)
class JobPiece:
    """A piece of a job's work: usually one clip, or one clip and its mirror.

    name: the clip's name. params: Snakemake's params, those of the rule and those of this clip. input: name
    of each input -> the piece's file, or a list of files for an input in `files_per_clip` (see `job_pieces`).
    output: name of each output -> the piece's file.
    """

    name: str
    params: Mapping[str, Any]
    input: Mapping[str, Any]
    output: Mapping[str, str]

    @property
    def files(self) -> list[str]:
        """All input files, ordered by the names of the inputs."""
        return [file for _, files in sorted(self.input.items()) for file in _as_list(files)]


def job_pieces(snakemake: Any) -> list[JobPiece]:
    """The pieces of a job. snakemake: the object that Snakemake gives to scripts.

    params.per_clip: a list with the params of each piece; the param `clip` is the piece's name.
    params.files_per_clip (optional): name of an input -> list with the number of files of each piece. Each
    other input, and each output, has one file for each piece, or one file for all pieces. An input or output
    without files is left out of the pieces.
    """
    not_common = ("per_clip", "files_per_clip")
    common = {name: value for name, value in snakemake.params.items() if name not in not_common}
    per_clip, counts = snakemake.params.per_clip, snakemake.params.get("files_per_clip", {})
    inputs = {
        name: _files_of_pieces(_as_list(files), len(per_clip), counts.get(name))
        for name, files in snakemake.input.items()
    }
    outputs = {
        name: _files_of_pieces(_as_list(files), len(per_clip)) for name, files in snakemake.output.items()
    }
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
    """Call `make` for each piece of a job, except for pieces whose files an earlier try has finished.

    Finished files are kept in a second place (see `hobble.workflow.kept_files`), and are used again if they
    are undamaged and nothing that they depend on has changed. If a piece fails, its error is reported, and
    the other pieces are still made, unless the disk is full or read-only. If any piece failed, the process
    exits at the end with status 1, and Snakemake deletes the job's outputs. The next try uses the kept files.

    snakemake: the object that Snakemake gives to scripts. make: function that makes the files of a piece.
    """
    with log_job(snakemake) as report:
        checksums.delete(snakemake.output)
        # Each data set and each batch has a rule of its own. The rules that make the same kind of file are a
        # family, and share the kept files.
        kept, digests = KeptFiles(family_of(snakemake.rule)), _Digests()
        all_pieces = job_pieces(snakemake)
        reused = failed = 0
        for piece in all_pieces:
            try:
                reused += _make_piece(piece, make, kept, digests, report)
            except Exception as error:
                report.error(error)
                failed += 1
                if _is_disk_error(error):
                    break
        if len(all_pieces) > 1 or reused:
            report.logger.info(
                "%d pieces, %d of them kept from before, %d failed", len(all_pieces), reused, failed
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
    """Make a piece, or use its kept files. Returns whether kept files were used."""
    outputs, began = list(piece.output.values()), time.monotonic()
    with check_and_record(piece.files, outputs):
        key = fingerprint(piece.params, digests.of(piece.files), outputs)
        if kept.restore(key, outputs):
            return True
        report.logger.info("%s:", piece.name)
        make(piece, report.logger)
    kept.keep(key, outputs, time.monotonic() - began)
    return False


class _Digests:
    """Computes the SHA-256 of files. A file that several pieces need is read only once."""

    def __init__(self) -> None:
        self.computed: dict[tuple[str, checksums.Stamp], str] = {}

    def of(self, files: list[str]) -> list[tuple[str, str]]:
        """(file name without folder, SHA-256) of each file that exists."""
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
        return "cannot be read"  # no error here: the piece that reads the file reports why


def _as_list(files: Any) -> list[str]:
    return [files] if isinstance(files, str) else list(files)


def _files_of_pieces(files: list[str], pieces: int, counts: list[int] | None = None) -> list[Any]:
    """The file of each piece or, if `counts` is given, the list of files of each piece.

    files: one file for each piece, or one for all pieces; if there are none, [] is returned. pieces: number
    of pieces. counts: number of files of each piece.
    """
    if counts is not None:
        assert sum(counts) == len(files), f"{len(files)} files, but files_per_clip adds up to {sum(counts)}"
        starts = [sum(counts[:n]) for n in range(pieces)]
        return [files[start : start + count] for start, count in zip(starts, counts, strict=True)]
    if len(files) == 1:
        return files * pieces
    assert len(files) in (0, pieces), f"{len(files)} files for {pieces} pieces: {files}"
    return files


def _is_disk_error(error: Exception) -> bool:
    """Whether an error has one of DISK_ERRORS as its cause. An InputError is raised from its cause."""
    cause = error.__cause__ if isinstance(error, InputError) else error
    return isinstance(cause, OSError) and cause.errno in DISK_ERRORS
