"""Snakemake's logger plugin `hobble`, which the default profile names; see `hobble.workflow.terminal`."""

from __future__ import annotations

import sys
from logging import LogRecord

from snakemake.logging import DefaultFilter, DefaultFormatter
from snakemake_interface_logger_plugins.base import LogHandlerBase

from hobble.workflow.terminal import Terminal


class LogHandler(LogHandlerBase):
    """Few words on standard error; with -p (or --verbose, --debug-dag) all of Snakemake's own."""

    def __post_init__(self) -> None:
        asked = self.common_settings
        stream = sys.stdout if asked.stdout else sys.stderr
        self.full = asked.printshellcmds or asked.verbose or asked.debug_dag
        quiet, debug = asked.quiet, (asked.debug_dag, asked.verbose, asked.dryrun, asked.printshellcmds)
        self.snakemakes = DefaultFilter(quiet, *debug)
        self.snakemakes_words = DefaultFormatter(quiet, asked.show_failed_logs)
        self.terminal = Terminal(stream, stream.isatty(), asked.dryrun)

    def emit(self, record: LogRecord) -> None:
        """Say what there is to say of a record."""
        try:
            if not self.snakemakes.filter(record):
                return
            if self.full:
                text = self.snakemakes_words.format(record)
                self.terminal.stream.write(f"{text}\n")
            else:
                self.terminal.take(record)
        except BrokenPipeError:
            raise
        except Exception:
            self.handleError(record)

    def close(self) -> None:
        """The summary."""
        if not self.full:
            self.terminal.close()
        super().close()

    @property
    def writes_to_stream(self) -> bool:
        """It does: Snakemake then leaves the terminal to it."""
        return True

    @property
    def writes_to_file(self) -> bool:
        """It does not."""
        return False

    @property
    def has_filter(self) -> bool:
        """It sees everything."""
        return True

    @property
    def has_formatter(self) -> bool:
        """It words everything."""
        return True

    @property
    def needs_rulegraph(self) -> bool:
        """It does not."""
        return False
