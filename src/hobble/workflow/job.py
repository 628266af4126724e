"""The context in which every job's script runs: its log, checks of its files, and errors as messages."""

from __future__ import annotations

import contextlib
import logging
import os
import sys
import traceback
from collections.abc import Iterator
from typing import Any

from hobble.core.errors import HobbleError
from hobble.workflow import checksums
from hobble.workflow.clip_batches import family_of
from hobble.workflow.lifetime import ends_with_run
from hobble.workflow.peak_memory import peak_memory_mb

BUG = "This is a bug in Hobble, not a fault in your data. Please report it with the log."


@contextlib.contextmanager
def job(snakemake: Any) -> Iterator[logging.Logger]:
    """Run a script with logging, checks of its files, and clear errors.

    snakemake: the object that Snakemake gives to scripts. It is an error if an input has changed since it was
    made, or changes while this job runs. Logging and other errors are handled by `reporting`.
    """
    with reporting(snakemake) as report:
        checksums.forget(getattr(snakemake, "output", ()))
        with checked(getattr(snakemake, "input", ()), getattr(snakemake, "output", ())):
            yield report.logger


@contextlib.contextmanager
def checked(inputs: Any, outputs: Any) -> Iterator[None]:
    """Check the inputs before and after the work in this context, then write the outputs' checksums."""
    before = checksums.stamps(inputs)
    checksums.verify(inputs)
    yield
    checksums.check_unchanged(before)
    checksums.record(outputs)


@contextlib.contextmanager
def reporting(snakemake: Any) -> Iterator[JobLog]:
    """Run a script with logging and clear errors. If the run of Snakemake ends, the script ends, too.

    Everything is logged to the job's log file; warnings and errors also go to the terminal. Every exception
    ends the process with status 1.
    """
    report = JobLog(str(snakemake.log[0]), family_of(snakemake.rule))
    try:
        with ends_with_run():
            yield report
        report.logger.info("took %.0f MB of memory at most", peak_memory_mb())
    except Exception as error:
        report.error(error)
        sys.exit(1)
    finally:
        logging.shutdown()


class JobLog:
    """A job's log file, and its messages on the terminal, which begin with the name of the rule."""

    def __init__(self, path: str, rule: str) -> None:
        self.path = path
        with contextlib.suppress(OSError):
            os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
            open(path, "w").close()
        self.logger = logging.getLogger("hobble")
        self.logger.setLevel(logging.INFO)
        to_file = _LogFile(path, encoding="utf-8", delay=True)
        to_file.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
        self.terminal = logging.StreamHandler(sys.stderr)
        self.terminal.setLevel(logging.WARNING)
        # A message on a terminal first clears the line of progress.
        clear = "\r\x1b[K" if sys.stderr.isatty() else ""
        self.terminal.setFormatter(logging.Formatter(f"{clear}{rule}: %(message)s"))
        self.logger.handlers = [to_file, self.terminal]
        logging.captureWarnings(True)

    def error(self, error: Exception) -> None:
        """Report an error. Of a HobbleError, only the message is reported.

        For most other errors the terminal shows one line, and the log file also has the traceback.
        """
        if isinstance(error, HobbleError):
            self.logger.error("%s", error)
        elif isinstance(error, MemoryError):
            self.logger.error("out of memory. Give the job more memory, or use a smaller data set or batch.")
        elif isinstance(error, OSError):
            # Such as a full disk or a missing permission, if no other code has raised a HobbleError for it.
            path, reason = error.filename or "a file", error.strerror or error
            self.logger.error("%s: %s. See %s", path, reason, self.path)
            self._trace(error)
        else:
            self.logger.error("%s: %s. %s See %s", type(error).__name__, error, BUG, self.path)
            self._trace(error)

    def _trace(self, error: Exception) -> None:
        """Write the traceback to the log, not to the terminal."""
        self.logger.removeHandler(self.terminal)
        self.logger.error("%s", "".join(traceback.format_exception(error)))
        self.logger.addHandler(self.terminal)


class _LogFile(logging.FileHandler):
    """A log file that ignores failed writes, so that on a full disk messages still reach the terminal."""

    def emit(self, record: logging.LogRecord) -> None:
        with contextlib.suppress(OSError):
            super().emit(record)

    def handleError(self, record: logging.LogRecord) -> None:
        pass

    def close(self) -> None:
        with contextlib.suppress(OSError):
            super().close()
