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
TAIL_BYTES = 1 << 16  # an error message is searched for in this many bytes at the end of a job's log
# A line of a job's log that reports an error: date, time, ERROR and the message.
ERROR_LINE = re.compile(r"^\S+ \S+ ERROR (.*)$", re.M)
# A line of a job's log that says how far the job has come, such as "section 1: 34 % done, 8 min left".
SHARE_LINE = re.compile(r"^\S+ \S+ INFO .*?(\d+ % done.*)$", re.M)
# Snakemake's messages about a failed job and about the end of a run in which jobs failed. They are not shown,
# because this module reports the same in fewer words.
JOB_ENDED = re.compile(r"CalledProcessError|Command 'set -euo pipefail|returned non-zero exit status")
SUPERFLUOUS = re.compile(
    r"Exiting because a job execution failed|Look below for error messages|^Shutting down|"
    r"^At least one job did not complete|^WorkflowError:\s*At least one job did not complete"
)
# What Snakemake puts around a message of the Snakefile: the place in the code. Users do not need it.
PLACE = re.compile(
    r'^WorkflowError in file ".*Snakefile", line \d+:\n|\n  File ".*Snakefile", line \d+, in <module>'
)
# Snakemake's messages that are shown although they are no warnings.
SHOWN_MESSAGES = re.compile(r"^Nothing to be done|^This was a dry-run|^Unlocking|^Touching|^Error")
# The rule `clip_file` finds its file already there, because a batch made it. Snakemake warns of this.
FOUND_OUTPUT = "were not present when the DAG was created"
STOP_MESSAGE = "Terminating processes on user request"  # Snakemake prints this when the user stops the run
STAGES = (  # in the order in which data passes through them
    *("synthetic", "motion", "labels", "channels", "terrain", "database", "training", "runtime"),
    *("evaluation", "report"),
)
FOLLOWS = "Input files updated by another job"  # a reason that is left out if there is another
MANY_REASONS = 3  # at most this many reasons are listed for a rule
# The Snakefile adds functions: (rule, wildcards) of each planned job -> sentences about the plan.
ABOUT_PLAN: list[Callable[[Sequence[tuple[str, Mapping[str, str]]]], list[str]]] = []


@dataclass(frozen=True)
class Job:
    """What is printed about a job.

    rule: the rule's name. wildcards: name -> value. log: path of its log, or several with commas. began: when
    it started, seconds. reason: why it has to run.
    """

    rule: str
    wildcards: Mapping[str, str]
    log: str
    began: float
    reason: str = ""

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
        self.jobs: dict[int, Job] = {}  # Snakemake's number of a job -> each job that has started
        self.running: dict[int, Job] = {}  # the same for the jobs that are running
        self.failed: list[Job] = []
        self.done = self.total = 0  # numbers of finished jobs and of all jobs
        self.stopped = False  # whether the user has stopped the run
        self.stats: Counter[str] = Counter()  # rule -> number of its jobs
        self.named: set[int] = set()  # the jobs whose logs have been named
        self.lock = threading.RLock()
        self.progress_shown = False  # whether the line of progress is on the terminal now
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
            self._clear_progress()
            if not self.closed:
                self.closed = bool(self.jobs or self.failed or self.stats)
                self._print_plan() if self.dryrun else self._print_summary()

    def _print_summary(self) -> None:
        if not (self.jobs or self.failed):
            return
        took = format_duration(self.now() - self.began)
        count = f"{self.done} of {self.total or len(self.jobs)} jobs done in {took}"
        if self.failed:
            self._print_line(f"{count}, {len(self.failed)} failed:")
            for job in self.failed:
                self._print_line(f"  {job.name}: {job.log}")
            self._print_line("When this is fixed, the same command continues from here.")
        elif self.stopped:
            self._print_line(f"{count}, then stopped. The same command continues from here.")
        else:
            self._print_line(f"{count}.")

    # The methods for Snakemake's events. The method _<event> gets the fields of the event's log record.

    def _run_info(self, data: Mapping[str, Any]) -> None:
        """The jobs are planned: print how many each rule has. A dry run prints its plan at the end."""
        stats = data.get("stats") or {}  # name of a rule, or "total" -> number of jobs
        self.total = stats.get("total", self.total)
        first, self.stats = not self.stats, Counter({r: n for r, n in stats.items() if r != "total"})
        if self.dryrun:
            if not first:  # now all jobs are known
                self.close()
        elif first:
            largest = ", ".join(f"{count} {rule}" for rule, count in self.stats.most_common(6))
            self._print_line(f"{self.total} jobs: {largest}{', ...' if len(self.stats) > 6 else ''}")

    def _print_plan(self) -> None:
        """Print the plan of a dry run: a table of the rules by stage, and why they have to run."""
        if not self.stats:
            return
        of_rule: dict[str, list[Job]] = {}
        for job in self.jobs.values():
            of_rule.setdefault(job.rule, []).append(job)
        rows = [("stage", "job", "count", "reason")]
        for rule, count in self.stats.items():
            mine = of_rule.get(rule, [])
            rows.append((mine[0].stage if mine else "", rule, str(count), _reasons(mine)))
        rows[1:] = sorted(rows[1:], key=lambda row: [*STAGES, row[0]].index(row[0]))
        rows.append(("total", "", str(sum(self.stats.values())), ""))
        wide = [max(len(row[column]) for row in rows) for column in range(3)]
        lines = [f"{a:{wide[0]}}  {b:{wide[1]}}  {c:>{wide[2]}}  {d}".rstrip() for a, b, c, d in rows]
        self._print_line("\n".join(["Job stats:", *lines]))
        for about in ABOUT_PLAN:
            self._print_line("\n".join(about([(job.rule, job.wildcards) for job in self.jobs.values()])))

    def _job_info(self, data: Mapping[str, Any]) -> None:
        """A job starts, or a dry run lists it."""
        self.jobs[data["jobid"]] = self.running[data["jobid"]] = self._job_of_event(data)
        self._progress({})

    def _job_finished(self, data: Mapping[str, Any]) -> None:
        """A job has ended without an error."""
        self.running.pop(data["job_id"], None)

    def _progress(self, data: Mapping[str, Any]) -> None:
        """Print the line of progress. data: may have new values of `done` and `total`."""
        self.done, self.total = data.get("done", self.done), data.get("total", self.total)
        if self.dryrun or not self.total:
            return
        for number, job in self.running.items():
            if job.log and number not in self.named and self.now() - job.began > LONG_SECONDS:
                self.named.add(number)
                self._print_line(f"{job.name}: its log is {job.log}")
        doing = list(dict.fromkeys(_doing(job) for job in self.running.values()))
        took = format_duration(self.now() - self.began)
        line = f"{self.done}/{self.total} jobs, {took}" + (f": {'; '.join(doing)}" if doing else "")
        if self.live:
            self.stream.write(f"\r\x1b[K{line[: shutil.get_terminal_size((100, 24)).columns - 1]}")
            self.stream.flush()
            self.progress_shown = True
        elif self.now() - self.last_line >= PROGRESS_SECONDS:
            self.last_line = self.now()
            self._print_line(line)

    def _job_error(self, data: Mapping[str, Any]) -> None:
        """A job has failed."""
        job = self.jobs.get(data["jobid"]) or self._job_of_event(data)
        self.running.pop(data["jobid"], None)
        if self.stopped:
            return
        self.failed.append(job)
        if not _last_match(job.log, ERROR_LINE):  # if there is an error in the log, the job has printed it
            self._print_line(
                f"{job.name}: ended without a message; it may have been killed. Its log: {job.log}"
            )

    def _job_of_event(self, data: Mapping[str, Any]) -> Job:
        """The job that an event of Snakemake is about. data: fields of the event's log record."""
        logs = ", ".join(str(log) for log in data.get("log") or ())
        wildcards = dict(data.get("wildcards") or {})
        return Job(str(data["rule_name"]), wildcards, logs, self.now(), str(data.get("reason") or ""))

    def _show_message(self, record: logging.LogRecord) -> None:
        """Print the text of a record if it is an error, a warning or one of SHOWN_MESSAGES."""
        text = str(record.msg or "").strip()
        if STOP_MESSAGE in text:
            self.stopped = True
            self._print_line("Stopping the running jobs.")
        elif record.levelno >= logging.ERROR:
            if not (JOB_ENDED.search(text) or SUPERFLUOUS.search(text)) and text:
                self._print_line(PLACE.sub("", text))
        elif FOUND_OUTPUT not in text and (record.levelno >= logging.WARNING or SHOWN_MESSAGES.search(text)):
            self._print_line(text)

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


def _reasons(jobs: Sequence[Job]) -> str:
    """Why the jobs of a rule have to run: Snakemake's reasons, each with one of the files that it names."""
    found: dict[str, str] = {}
    for job in jobs:
        for reason in job.reason.split("; "):
            what, _, files = reason.partition(": ")
            found.setdefault(what.strip(), files.split(", ")[0].strip())
    if len(found) > 1:
        found.pop(FOLLOWS, None)
    listed = [f"{what} ({file})" if file else what for what, file in found.items() if what]
    return "; ".join(listed[:MANY_REASONS]) + ("; ..." if len(listed) > MANY_REASONS else "")


def _doing(job: Job) -> str:
    """The job's rule, and if its log says how far it has come, the last such words."""
    said = _last_match(job.log, SHARE_LINE)
    return f"{job.name} {said}" if said else job.rule


def _last_match(log: str, pattern: re.Pattern[str]) -> str:
    """What the last line of this pattern in a job's log says, or "" if there is none."""
    try:
        with open(Path(log), "rb") as file:
            file.seek(0, 2)
            file.seek(max(0, file.tell() - TAIL_BYTES))
            found = pattern.findall(file.read().decode(errors="replace"))
    except OSError:
        return ""
    return found[-1] if found else ""


class LogHandler(LogHandlerBase):
    """Prints short messages to standard error; with -p, --verbose or --debug-dag, all of Snakemake's."""

    def __post_init__(self) -> None:
        settings = self.common_settings
        stream = sys.stdout if settings.stdout else sys.stderr
        shown = (settings.debug_dag, settings.verbose, settings.dryrun, settings.printshellcmds)
        self.full = settings.printshellcmds or settings.verbose or settings.debug_dag
        self.snakemake_filter = DefaultFilter(settings.quiet, *shown)
        self.snakemake_formatter = DefaultFormatter(settings.quiet, settings.show_failed_logs)
        self.terminal = Terminal(stream, stream.isatty(), settings.dryrun)
        threading.Thread(target=self._tick, daemon=True).start()

    def _tick(self) -> None:
        while not self.terminal.closed:
            time.sleep(TICK_SECONDS)
            self.terminal.tick()

    def emit(self, record: logging.LogRecord) -> None:
        """Print a record, in short or in full."""
        try:
            if not self.snakemake_filter.filter(record):
                return
            if self.full:
                print(self.snakemake_formatter.format(record), file=self.terminal.stream)
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

    writes_to_stream = True  # so that Snakemake itself prints nothing
    has_filter = has_formatter = True
    writes_to_file = needs_rulegraph = False
