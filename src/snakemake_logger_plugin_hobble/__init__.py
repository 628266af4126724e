"""The Snakemake logger plugin `hobble`: a line of progress, each failure once, a summary.

With `snakemake -p` it prints all records, in Snakemake's form.
"""

from __future__ import annotations

import logging
import re
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from snakemake.logging import DefaultFilter, DefaultFormatter
from snakemake_interface_logger_plugins.base import LogHandlerBase

PROGRESS_SECONDS = 10.0  # between lines of progress if the output goes to a file
WIDTH = 100  # columns of the line of progress on a terminal
MAX_FAILURES_LISTED = 20  # the summary lists at most this many failed jobs
TAIL_BYTES = 1 << 16  # an error message is searched for in this many bytes at the end of a job's log
# A line of a job's log that reports an error: date, time, ERROR and the message.
ERROR_LINE = re.compile(r"^\S+ \S+ ERROR (.*)$", re.M)
# Snakemake's messages about a failed job and about the end of a run in which jobs failed. They are not shown,
# because this module reports the same in fewer words.
JOB_ENDED = re.compile(r"CalledProcessError|Command 'set -euo pipefail|returned non-zero exit status")
SUPERFLUOUS = re.compile(
    r"Exiting because a job execution failed|Look below for error messages|^Shutting down|"
    r"^At least one job did not complete|^WorkflowError:\s*At least one job did not complete"
)
# Snakemake's messages that are shown although they are no warnings.
SHOWN_MESSAGES = re.compile(r"^Nothing to be done|^Reasons:|^This was a dry-run|^Unlocking|^Touching|^Error")
# The rule `clip_file` finds its file already there, because a batch made it. Snakemake warns of this.
FOUND_OUTPUT = "were not present when the DAG was created"
STOP_MESSAGE = "Terminating processes on user request"  # Snakemake prints this when the user stops the run
# A line in Snakemake's message about why it runs jobs. It is removed, because jobs are not listed above it.
JOB_HINT = re.compile(r"^ *\(check individual jobs above for details\)\n", re.M)


@dataclass(frozen=True)
class Job:
    """What is printed about a job.

    rule: the rule's name. about: the job's wildcards. log: path of its log, or several with commas.
    """

    rule: str
    about: str
    log: str

    @property
    def name(self) -> str:
        """The job's name in messages: its rule, then its wildcards."""
        return f"{self.rule} {self.about}".strip()


class Terminal:
    """Prints the output of one run.

    live: whether to overwrite the line of progress, as on a terminal, instead of printing a new line every
    PROGRESS_SECONDS. dryrun: whether the run is a dry run. now: function that returns the time in seconds.
    """

    def __init__(
        self, stream: TextIO, live: bool, dryrun: bool = False, now: Callable[[], float] = time.monotonic
    ) -> None:
        self.stream, self.live, self.dryrun, self.now = stream, live, dryrun, now
        self.began = self.last_line = now()  # `last_line`: when a line of progress was last written to a file
        self.jobs: dict[int, Job] = {}  # Snakemake's number of a job -> each job that has started
        self.running: dict[int, Job] = {}  # the same for the jobs that are running
        self.failed: list[Job] = []
        self.done = self.total = 0  # numbers of finished jobs and of all jobs
        self.stopped = False  # whether the user has stopped the run
        self.announced = False  # whether the number of jobs has been printed
        self.progress_shown = False  # whether the line of progress is on the terminal now
        self.closed = False  # whether the summary has been printed

    def show_record(self, record: logging.LogRecord) -> None:
        """Print what users need of a record of Snakemake's logger, and note what it says about jobs."""
        event = str(getattr(record, "event", None) or "")
        method_of_event = getattr(self, f"_{event}", None)
        if method_of_event is not None:
            method_of_event(record.__dict__)
        elif event in ("", "error"):
            self._show_message(record)

    def close(self) -> None:
        """Print the summary if jobs have run, but only once: `logging` calls this again at exit."""
        self._clear_progress()
        if self.closed or self.dryrun or not (self.jobs or self.failed):
            return
        self.closed = True
        took = _format_duration(self.now() - self.began)
        count = f"{self.done} of {self.total or len(self.jobs)} jobs done in {took}"
        if self.failed:
            self._print_line(f"{count}, {len(self.failed)} failed:")
            for job in self.failed[:MAX_FAILURES_LISTED]:
                self._print_line(f"  {job.name}: {job.log}")
            if len(self.failed) > MAX_FAILURES_LISTED:
                self._print_line(f"  and {len(self.failed) - MAX_FAILURES_LISTED} more")
            self._print_line("When this is fixed, the same command continues from here.")
        elif self.stopped:
            self._print_line(f"{count}, then stopped. The same command continues from here.")
        else:
            self._print_line(f"{count}.")

    # The methods for Snakemake's events. The method _<event> gets the fields of the event's log record.

    def _run_info(self, data: Mapping[str, Any]) -> None:
        """The jobs are planned: print how many jobs each rule has."""
        stats = data.get("stats") or {}  # name of a rule, or "total" -> number of jobs
        self.total = stats.get("total", self.total)
        rules = Counter({rule: count for rule, count in stats.items() if rule != "total"})
        if self.dryrun and not self.announced:
            self._print_line(_format_table(rules))
        elif not self.announced:
            largest = ", ".join(f"{count} {rule}" for rule, count in rules.most_common(6))
            self._print_line(f"{self.total} jobs: {largest}{', ...' if len(rules) > 6 else ''}")
        self.announced = True

    def _job_info(self, data: Mapping[str, Any]) -> None:
        """A job starts."""
        job = _job_of_event(data)
        self.jobs[data["jobid"]] = self.running[data["jobid"]] = job
        self._progress({})

    def _job_finished(self, data: Mapping[str, Any]) -> None:
        """A job has ended without an error."""
        self.running.pop(data["job_id"], None)

    def _progress(self, data: Mapping[str, Any]) -> None:
        """Print the line of progress. data: may have new values of `done` and `total`."""
        self.done, self.total = data.get("done", self.done), data.get("total", self.total)
        if self.dryrun or not self.total:
            return
        took = self.now() - self.began
        rules = ", ".join(Counter(job.rule for job in self.running.values()))  # each rule once
        line = f"{self.done}/{self.total} jobs, {_format_duration(took)}" + (f": {rules}" if rules else "")
        if self.live:
            self.stream.write(f"\r\x1b[K{line[:WIDTH]}")
            self.stream.flush()
            self.progress_shown = True
        elif self.now() - self.last_line >= PROGRESS_SECONDS:
            self.last_line = self.now()
            self._print_line(line)

    def _job_error(self, data: Mapping[str, Any]) -> None:
        """A job has failed."""
        job = self.jobs.get(data["jobid"]) or _job_of_event(data)
        self.running.pop(data["jobid"], None)
        if self.stopped:
            return
        self.failed.append(job)
        if not _last_error(job.log):  # if there is an error in the log, the job has printed it
            self._print_line(
                f"{job.name}: ended without a message; it may have been killed. Its log: {job.log}"
            )

    def _show_message(self, record: logging.LogRecord) -> None:
        """Print the text of a record if it is an error, a warning or one of SHOWN_MESSAGES."""
        text = str(record.msg or "").strip()
        if STOP_MESSAGE in text:
            self.stopped = True
            self._print_line("Stopping the running jobs.")
        elif record.levelno >= logging.ERROR:
            if not (JOB_ENDED.search(text) or SUPERFLUOUS.search(text)) and text:
                self._print_line(text)
        elif FOUND_OUTPUT not in text and (record.levelno >= logging.WARNING or SHOWN_MESSAGES.search(text)):
            self._print_line(JOB_HINT.sub("", text))

    def _print_line(self, text: str) -> None:
        """Print a line of text, in place of the line of progress if this is shown."""
        self._clear_progress()
        self.stream.write(f"{text}\n")
        self.stream.flush()

    def _clear_progress(self) -> None:
        """Clear the line of progress if it is shown."""
        if self.progress_shown:
            self.stream.write("\r\x1b[K")
            self.progress_shown = False


def _job_of_event(data: Mapping[str, Any]) -> Job:
    """The job that an event of Snakemake is about. data: fields of the event's log record."""
    rule, logs = str(data["rule_name"]), [str(log) for log in data.get("log") or ()]
    about = " ".join(str(value) for value in dict(data.get("wildcards") or {}).values())
    return Job(rule, about, ", ".join(logs))


def _format_table(rules: Mapping[str, int]) -> str:
    """A table with the number of jobs of each rule, in Snakemake's form. rules: rule -> this number."""
    width = max(map(len, [*rules, "total"]))
    counts = [*rules.items(), ("total", sum(rules.values()))]
    lines = [f"{rule:<{width}}  {count:>7}" for rule, count in counts]
    return "\n".join(["Job stats:", f"{'job':<{width}}    count", f"{'-' * width}  -------", *lines])


def _last_error(log: str) -> str:
    """The last error message in a job's log, or "" if there is none."""
    try:
        with open(Path(log), "rb") as file:
            file.seek(0, 2)
            file.seek(max(0, file.tell() - TAIL_BYTES))
            messages = ERROR_LINE.findall(file.read().decode(errors="replace"))
    except OSError:
        return ""
    return messages[-1] if messages else ""


def _format_duration(seconds: float) -> str:
    """A time as text, such as "3 min 20 s"."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02} min"
    return f"{minutes} min {rest:02} s" if minutes else f"{rest} s"


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

    def emit(self, record: logging.LogRecord) -> None:
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
