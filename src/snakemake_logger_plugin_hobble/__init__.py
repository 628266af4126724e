"""The Snakemake logger plugin `hobble`: the plan and its reasons, progress, each failure once, a summary.

With `snakemake -p` it prints all records, in Snakemake's form.
"""

import logging
import re
import shutil
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from snakemake.logging import DefaultFilter, DefaultFormatter
from snakemake_interface_logger_plugins.base import LogHandlerBase

from hobble.core.messages import format_duration

TICK_SECONDS = 1.0  # between two updates of the line of progress on a terminal
PROGRESS_SECONDS = 30.0  # between lines of progress if the output goes to a file
LONG_SECONDS = 15.0  # the log of a job that runs longer than this is named
# A line of a job's log that reports an error: date, time, ERROR and the message.
ERROR_LINE = re.compile(r"^\S+ \S+ ERROR (.*)$", re.M)
# A line of a job's log that says how far the job has come, such as "section 1: 34 % done, 8 min left".
SHARE_LINE = re.compile(r"^\S+ \S+ INFO .*?(\d+ % done.*)$", re.M)
# Snakemake's messages about a failed job and about the end of a run in which jobs failed, and that the rule
# `clip_file` finds its file already there, because a batch made it. They are not shown: this module reports
# failures in fewer words.
NOT_SHOWN = re.compile(
    r"CalledProcessError|Command 'set -euo pipefail|returned non-zero exit status|^Shutting down|"
    r"Exiting because a job execution failed|Look below for error messages|"
    r"^(WorkflowError:\s*)?At least one job did not complete|were not present when the DAG was created"
)
# What Snakemake puts around a message of the Snakefile: the place in the code. Users do not need it.
PLACE = re.compile(r'^WorkflowError in file ".*", line \d+:\n|\n  File ".*", line \d+, in <module>')
# Snakemake's messages that are shown although they are no warnings.
SHOWN_MESSAGES = re.compile(r"^Nothing to be done|^This was a dry-run|^Unlocking|^Touching|^Error")
# In the order in which data passes through them.
STAGES = "synthetic motion labels channels terrain database training runtime evaluation report"
CLEAR = "\r\x1b[K"  # clears a line of the terminal
# The Snakefile adds functions: (rule, wildcards) of each planned job -> sentences about the plan.
ABOUT_PLAN: list[Callable[[Sequence[tuple[str, Mapping[str, str]]]], list[str]]] = []


@dataclass
class Job:
    """What is printed about a job.

    rule: the rule's name. wildcards: name -> value. log: path of its log, or several with commas. began: when
    it started, seconds. reason: why it has to run. is_named: whether its log has been named.
    """

    rule: str
    wildcards: Mapping[str, str]
    log: str
    began: float
    reason: str = ""
    is_named: bool = False

    @property
    def name(self) -> str:
        """The job's name in messages: its rule, then its wildcards."""
        return " ".join([self.rule, *map(str, self.wildcards.values())])

    @property
    def stage(self) -> str:
        """The stage of the workflow, from the folder of the log: results/.../logs/<stage>/..."""
        parts = Path(self.log).parts
        return parts[parts.index("logs") + 1] if "logs" in parts else ""


class Terminal:
    """Prints the output of one run.

    live: whether to overwrite the line of progress, as on a terminal, instead of printing a new line every
    PROGRESS_SECONDS. dryrun: whether the run is a dry run. now: function that returns the time in seconds. A
    thread calls `tick`, so the public methods take turns.
    """

    def __init__(
        self, stream: TextIO, live: bool, dryrun: bool = False, now: Callable[[], float] = time.monotonic
    ) -> None:
        self.stream, self.live, self.dryrun, self.now = stream, live, dryrun, now
        self.began = self.last_line = now()  # `last_line`: when a line of progress was last written to a file
        self.running: dict[int, Job] = {}  # Snakemake's number of a job -> each one that runs, or is planned
        self.failed: list[Job] = []
        self.done = self.total = 0  # numbers of finished jobs and of all jobs
        self.stopped = False  # whether the user has stopped the run
        self.stats: dict[str, int] = {}  # rule -> number of its jobs
        self.lock = threading.RLock()
        self.closed = False  # whether the summary has been printed

    def show_record(self, record: logging.LogRecord) -> None:
        """Print what users need of a record of Snakemake's logger, and note what it says about jobs."""
        event = str(getattr(record, "event", None) or "")
        method_of_event = getattr(self, f"_{event}", None)
        with self.lock:
            if method_of_event is not None:
                method_of_event(record.__dict__)
            elif event in ("", "error"):
                self._show_message(record)

    def tick(self) -> None:
        """Show how far the running jobs have come."""
        with self.lock:
            if self.running and not self.closed:
                self._progress({})

    def close(self) -> None:
        """Print the summary, or the plan of a dry run, but only once: `logging` calls this again at exit."""
        with self.lock:
            if self.stats and not self.closed:
                self.closed = True
                self._print_plan() if self.dryrun else self._print_summary()

    def _print_summary(self) -> None:
        count = f"{self.done} of {self.total} jobs done in {format_duration(self.now() - self.began)}"
        if self.failed:
            logs = [f"  {job.name}: {job.log}" for job in self.failed]
            end = "When this is fixed, the same command continues from here."
            self._print_line("\n".join([f"{count}, {len(self.failed)} failed:", *logs, end]))
        else:
            stopped = ", then stopped. The same command continues from here"
            self._print_line(f"{count}{stopped if self.stopped else ''}.")

    # The methods for Snakemake's events. The method _<event> gets the fields of the event's log record.

    def _run_info(self, data: Mapping[str, Any]) -> None:
        """The jobs are planned: print how many each rule has. A dry run prints its plan at the end."""
        stats, is_first = dict(data.get("stats") or {}), not self.stats  # rule, or "total" -> number of jobs
        self.total = stats.pop("total", self.total)
        self.stats = stats
        if is_first and stats and not self.dryrun:
            largest = ", ".join(f"{count} {rule}" for rule, count in Counter(stats).most_common(6))
            self._print_line(f"{self.total} jobs: {largest}{', ...' if len(stats) > 6 else ''}")

    def _print_plan(self) -> None:
        """Print the plan of a dry run: a table of the rules by stage, and why they have to run."""
        rows = []
        for rule, count in self.stats.items():
            mine = [job for job in self.running.values() if job.rule == rule]
            rows.append((mine[0].stage if mine else "", rule, str(count), _reasons(mine)))
        rows.sort(key=lambda row: STAGES.find(row[0]))
        rows = [("stage", "job", "count", "reason"), *rows, ("total", "", str(self.total), "")]
        wide = [max(len(row[column]) for row in rows) for column in range(3)]
        lines = [f"{a:{wide[0]}}  {b:{wide[1]}}  {c:>{wide[2]}}  {d}".rstrip() for a, b, c, d in rows]
        self._print_line("\n".join(["Job stats:", *lines]))
        for about in ABOUT_PLAN:
            self._print_line("\n".join(about([(job.rule, job.wildcards) for job in self.running.values()])))

    def _job_info(self, data: Mapping[str, Any]) -> None:
        """A job starts, or a dry run lists it."""
        self.running[data["jobid"]] = self._job_of_event(data)
        self._progress({})

    def _job_finished(self, data: Mapping[str, Any]) -> None:
        """A job has ended without an error."""
        self.running.pop(data["job_id"], None)

    def _progress(self, data: Mapping[str, Any]) -> None:
        """Print the line of progress. data: may have new values of `done` and `total`."""
        self.done, self.total = data.get("done", self.done), data.get("total", self.total)
        if self.dryrun or not self.total:
            return
        for job in self.running.values():
            if job.log and not job.is_named and self.now() - job.began > LONG_SECONDS:
                job.is_named = True
                self._print_line(f"{job.name}: its log is {job.log}")
        said = ((job, _last_match(job.log, SHARE_LINE)) for job in self.running.values())
        doing = dict.fromkeys(f"{job.name} {share}" if share else job.rule for job, share in said)
        took = format_duration(self.now() - self.began)
        line = f"{self.done}/{self.total} jobs, {took}" + (f": {'; '.join(doing)}" if doing else "")
        if self.live:
            self.stream.write(f"{CLEAR}{line[: shutil.get_terminal_size((100, 24)).columns - 1]}")
            self.stream.flush()
        elif self.now() - self.last_line >= PROGRESS_SECONDS:
            self.last_line = self.now()
            self._print_line(line)

    def _job_error(self, data: Mapping[str, Any]) -> None:
        """A job has failed."""
        job = self.running.pop(data["jobid"], None) or self._job_of_event(data)
        if self.stopped:
            return
        self.failed.append(job)
        if not _last_match(job.log, ERROR_LINE):  # if there is an error in the log, the job has printed it
            why = "ended without a message; it may have been killed"
            self._print_line(f"{job.name}: {why}. Its log: {job.log}")

    def _job_of_event(self, data: Mapping[str, Any]) -> Job:
        """The job that an event of Snakemake is about. data: fields of the event's log record."""
        logs = ", ".join(str(log) for log in data.get("log") or ())
        wildcards = dict(data.get("wildcards") or {})
        return Job(str(data["rule_name"]), wildcards, logs, self.now(), str(data.get("reason") or ""))

    def _show_message(self, record: logging.LogRecord) -> None:
        """Print the text of a record if it is an error, a warning or one of SHOWN_MESSAGES."""
        text = str(record.msg or "").strip()
        is_shown = text and (record.levelno >= logging.WARNING or SHOWN_MESSAGES.search(text))
        if "Terminating processes on user request" in text:
            self.stopped = True
            self._print_line("Stopping the running jobs.")
        elif is_shown and not NOT_SHOWN.search(text):
            self._print_line(PLACE.sub("", text))

    def _print_line(self, text: str) -> None:
        """Print a line of text, on a terminal in place of the line of progress."""
        self.stream.write(f"{CLEAR if self.live else ''}{text}\n")
        self.stream.flush()


def _reasons(jobs: Sequence[Job]) -> str:
    """Why the jobs of a rule have to run: Snakemake's reasons, each with one of the files that it names."""
    found: dict[str, str] = {}
    for job in jobs:
        for reason in job.reason.split("; "):
            what, _, files = reason.partition(": ")
            found.setdefault(what.strip(), files.split(", ")[0].strip())
    if len(found) > 1:
        found.pop("Input files updated by another job", None)
    return "; ".join(f"{what} ({file})" if file else what for what, file in found.items())


def _last_match(log: str, pattern: re.Pattern[str]) -> str:
    """What the last line of this pattern in a job's log says, or "" if there is none."""
    try:
        found = pattern.findall(Path(log).read_text(errors="replace"))
    except OSError:
        return ""
    return found[-1] if found else ""


class LogHandler(LogHandlerBase):
    """Prints short messages to standard error; with -p, --verbose or --debug-dag, all of Snakemake's."""

    def __post_init__(self) -> None:
        settings = self.common_settings
        stream = sys.stdout if settings.stdout else sys.stderr
        shown = (settings.debug_dag, settings.verbose, settings.dryrun, settings.printshellcmds)
        self.is_full = settings.printshellcmds or settings.verbose or settings.debug_dag
        self.full = logging.StreamHandler(stream)
        self.full.addFilter(DefaultFilter(settings.quiet, *shown))
        self.full.setFormatter(DefaultFormatter(settings.quiet, settings.show_failed_logs))
        self.terminal = Terminal(stream, stream.isatty(), settings.dryrun)
        threading.Thread(target=self._tick, daemon=True).start()

    def _tick(self) -> None:
        while not self.terminal.closed:
            time.sleep(TICK_SECONDS)
            self.terminal.tick()

    def emit(self, record: logging.LogRecord) -> None:
        """Print a record, in short or in full."""
        if self.is_full:
            self.full.handle(record)
        elif self.full.filter(record):
            self.terminal.show_record(record)

    def close(self) -> None:
        """Print the summary."""
        if not self.is_full:
            self.terminal.close()
        super().close()

    writes_to_stream = has_filter = has_formatter = True  # so that Snakemake itself prints nothing
    writes_to_file = needs_rulegraph = False
