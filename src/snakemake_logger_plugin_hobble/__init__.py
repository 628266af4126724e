"""The Snakemake logger plugin `hobble`, set in the default profile; see `hobble.workflow.terminal`."""

from __future__ import annotations

import sys
from logging import LogRecord

from snakemake.logging import DefaultFilter, DefaultFormatter
from snakemake_interface_logger_plugins.base import LogHandlerBase

from hobble.workflow.terminal import Terminal


class LogHandler(LogHandlerBase):
    """Prints short messages to standard error; with -p, --verbose or --debug-dag, all of Snakemake's."""

    def __post_init__(self) -> None:
        settings = self.common_settings
        stream = sys.stdout if settings.stdout else sys.stderr
        self.full = settings.printshellcmds or settings.verbose or settings.debug_dag
        quiet, debug = (
            settings.quiet,
            (settings.debug_dag, settings.verbose, settings.dryrun, settings.printshellcmds),
        )
        self.snakemake_filter = DefaultFilter(quiet, *debug)
        self.snakemake_formatter = DefaultFormatter(quiet, settings.show_failed_logs)
        self.terminal = Terminal(stream, stream.isatty(), settings.dryrun)

    def emit(self, record: LogRecord) -> None:
        """Print a record, in short or in full."""
        try:
            if not self.snakemake_filter.filter(record):
                return
            if self.full:
                text = self.snakemake_formatter.format(record)
                self.terminal.stream.write(f"{text}\n")
            else:
                self.terminal.show_record(record)
        except BrokenPipeError:
            raise
        except Exception:
            self.handleError(record)

    def close(self) -> None:
        """Print the summary."""
        if not self.full:
            self.terminal.close()
        super().close()

    @property
    def writes_to_stream(self) -> bool:
        """True, so that Snakemake itself prints nothing."""
        return True

    @property
    def writes_to_file(self) -> bool:
        """False: it writes no file."""
        return False

    @property
    def has_filter(self) -> bool:
        """True: it filters records itself."""
        return True

    @property
    def has_formatter(self) -> bool:
        """True: it formats records itself."""
        return True

    @property
    def needs_rulegraph(self) -> bool:
        """False: it does not use the rule graph."""
        return False
