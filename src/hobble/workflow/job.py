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
from hobble.workflow.lifetime import ends_with_run
from hobble.workflow.usage import peak_memory_mb

BUG = "This is a bug in Hobble, not a fault in your data. Please report it with the log."


@contextlib.contextmanager
def job(snakemake: Any) -> Iterator[logging.Logger]:
    """Run a script with logging, checks of its files, and clear errors.

    Everything is logged to the rule's log file; warnings and errors also go to the terminal. Inputs that
    differ from what their jobs wrote, or that change while the job runs, raise HobbleError.
    Every exception ends the process with status 1. A HobbleError prints its message. Other exceptions print
    one line and write the traceback to the log.
    """
    path = snakemake.log[0]
    with contextlib.suppress(OSError):
        os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
        open(path, "w").close()
    logger = logging.getLogger("hobble")
    logger.setLevel(logging.INFO)
    to_file = _LogFile(path, encoding="utf-8", delay=True)
    to_file.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    to_terminal = logging.StreamHandler(sys.stderr)
    to_terminal.setLevel(logging.WARNING)
    # On a terminal, first clear the line of progress.
    wiped = "\r\x1b[K" if sys.stderr.isatty() else ""
    to_terminal.setFormatter(logging.Formatter(f"{wiped}{snakemake.rule}: %(message)s"))
    logger.handlers = [to_file, to_terminal]
    logging.captureWarnings(True)
    inputs, outputs = getattr(snakemake, "input", ()), getattr(snakemake, "output", ())
    try:
        checksums.forget(outputs)
        with ends_with_run():
            before = checksums.stamps(inputs)
            checksums.verify(inputs)
            yield logger
            checksums.check_unchanged(before)
            checksums.record(outputs)
        logger.info("took %.0f MB of memory at most", peak_memory_mb())
    except HobbleError as error:
        logger.error("%s", error)
        sys.exit(1)
    except MemoryError:
        logger.error("out of memory. Give the job more memory, or use a smaller data set or batch.")
        sys.exit(1)
    except OSError as error:
        # An error of the disk or of permissions that no other code has explained.
        place, reason = error.filename or "a file", error.strerror or error
        logger.error("%s: %s. See %s", place, reason, path)
        _to_log_only(logger, to_terminal)
        sys.exit(1)
    except Exception as error:
        logger.error("%s: %s. %s See %s", type(error).__name__, error, BUG, path)
        _to_log_only(logger, to_terminal)
        sys.exit(1)
    finally:
        logging.shutdown()


def _to_log_only(logger: logging.Logger, terminal: logging.Handler) -> None:
    """Write the traceback to the log, not to the terminal."""
    logger.removeHandler(terminal)
    logger.error("%s", traceback.format_exc())


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
