"""The context in which a job's script runs: it logs, checks files and turns errors into messages."""

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
    """Run a script with logging, checks of its files, and clear errors. Yields the logger.

    snakemake: the object that Snakemake gives to scripts. An input causes an error if it has changed since
    its own job wrote it, or if it changes while this job runs. `log_job` logs messages and errors.
    """
    with log_job(snakemake) as report:
        checksums.delete(getattr(snakemake, "output", ()))
        with check_and_record(getattr(snakemake, "input", ()), getattr(snakemake, "output", ())):
            yield report.logger


@contextlib.contextmanager
def check_and_record(inputs: Any, outputs: Any) -> Iterator[None]:
    """Check the inputs before and after the work in this context, then write the outputs' checksums.

    inputs, outputs: paths. Raises InputError for an input that is damaged or has changed.
    """
    before = checksums.stamps(inputs)
    checksums.verify(inputs)
    yield
    checksums.check_unchanged(before)
    checksums.record(outputs)


@contextlib.contextmanager
def log_job(snakemake: Any) -> Iterator[JobLog]:
    """Run a script with logging and clear errors. If the run of Snakemake ends, the script ends, too.

    Every message goes to the job's log file. Warnings and errors also go to the terminal. Every error ends
    the process with status 1.
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
    """Writes a job's messages to its log file, and warnings and errors also to the terminal.

    path: the log file. rule: name of the rule, with which each message on the terminal begins.
    """

    def __init__(self, path: str, rule: str) -> None:
        self.path = path
        with contextlib.suppress(OSError):
            os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
            open(path, "w").close()  # empty the log of an earlier try
        self.logger = logging.getLogger("hobble")
        self.logger.setLevel(logging.INFO)
        file_handler = _LogFile(path, encoding="utf-8", delay=True)
        file_handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
        self.terminal = logging.StreamHandler(sys.stderr)
        self.terminal.setLevel(logging.WARNING)
        # On a terminal, each message first clears the line of progress, which Snakemake's process prints.
        clear = "\r\x1b[K" if sys.stderr.isatty() else ""
        self.terminal.setFormatter(logging.Formatter(f"{clear}{rule}: %(message)s"))
        self.logger.handlers = [file_handler, self.terminal]
        logging.captureWarnings(True)

    def error(self, error: Exception) -> None:
        """Log an error. The log file also gets the traceback, except for a HobbleError or a lack of memory.

        The message of a HobbleError says everything that a user needs.
        """
        if isinstance(error, HobbleError):
            self.logger.error("%s", error)
        elif isinstance(error, MemoryError):
            self.logger.error("out of memory. Give the job more memory, or use a smaller data set or batch.")
        elif isinstance(error, OSError):
            # For example a full disk or a missing permission that no code has turned into a HobbleError.
            path, reason = error.filename or "a file", error.strerror or error
            self.logger.error("%s: %s. See %s", path, reason, self.path)
            self._log_traceback(error)
        else:
            self.logger.error("%s: %s. %s See %s", type(error).__name__, error, BUG, self.path)
            self._log_traceback(error)

    def _log_traceback(self, error: Exception) -> None:
        """Write the traceback to the log file, not to the terminal."""
        self.logger.removeHandler(self.terminal)
        self.logger.error("%s", "".join(traceback.format_exception(error)))
        self.logger.addHandler(self.terminal)


class _LogFile(logging.FileHandler):
    """A log file that ignores failed writes, so that messages reach the terminal even if the disk is full."""

    def emit(self, record: logging.LogRecord) -> None:
        with contextlib.suppress(OSError):
            super().emit(record)

    def handleError(self, record: logging.LogRecord) -> None:
        pass

    def close(self) -> None:
        with contextlib.suppress(OSError):
            super().close()
