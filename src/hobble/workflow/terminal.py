"""The terminal output of a run: one line of progress, each failure once, and a summary at the end.

The package `snakemake_logger_plugin_hobble` passes Snakemake's log records to this module. With
`snakemake -p` it prints all of them itself, in Snakemake's form.
"""

from __future__ import annotations

import logging
import re
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from hobble.workflow.clip_batches import MARK, dataset_of, family_of

PROGRESS_SECONDS = 10.0  # between lines of progress if the output goes to a file
WIDTH = 100  # columns of the line of progress on a terminal
MAX_FAILURES_LISTED = 20  # the summary lists at most this many failed jobs
TAIL_BYTES = 1 << 16  # at the end of a job's log, where the job's error message is searched for
MESSAGE = re.compile(r"^\S+ \S+ ERROR (.*)$", re.M)  # an error message in a job's log
# Messages of Snakemake that are not shown, because this module reports the same in fewer words.
JOB_ENDED = re.compile(r"CalledProcessError|Command 'set -euo pipefail|returned non-zero exit status")
SUPERFLUOUS = re.compile(
    r"Exiting because a job execution failed|Look below for error messages|^Shutting down|"
    r"^At least one job did not complete|^WorkflowError:\s*At least one job did not complete"
)
BATCH_RULES = re.compile(
    rf"(?<=^        )\w+(?:{MARK}[^,\n]+)?(?:, [^,\n]+)*$", re.M
)  # the list of rules in Snakemake's reasons for running jobs
# Messages of Snakemake that are shown although they are not warnings.
PASSED_ON = re.compile(r"^Nothing to be done|^Reasons:|^This was a dry-run|^Unlocking|^Touching|^Error")
STOP_MESSAGE = "Terminating processes on user request"
JOB_HINT = re.compile(r"^ *\(check individual jobs above for details\)\n", re.M)


@dataclass(frozen=True)
class Job:
    """What is printed about a job. about: its wildcards, or its data set and batch. log: its log file."""

    rule: str
    about: str
    log: str

    @property
    def name(self) -> str:
        """The rule, and the job's wildcards or batch."""
        return f"{self.rule} {self.about}".strip()


class Terminal:
    """The output of one run.

    live: whether to overwrite the line of progress, as on a terminal, instead of printing a line every
    PROGRESS_SECONDS. now: returns the time in seconds.
    """

    def __init__(
        self, stream: TextIO, live: bool, dryrun: bool = False, now: Callable[[], float] = time.monotonic
    ) -> None:
        self.stream, self.live, self.dryrun, self.now = stream, live, dryrun, now
        self.began = self.last = now()  # `last`: time of the last line of progress in a file
        self.jobs: dict[int, Job] = {}
        self.running: dict[int, Job] = {}
        self.failed: list[Job] = []
        self.done = self.total = 0
        self.stopped = False  # whether the user has stopped the run
        self.announced = False  # whether the number of jobs is printed
        self.shown = False  # whether the line of progress is on the terminal
        self.closed = False  # whether the summary is printed

    def take(self, record: logging.LogRecord) -> None:
        """Print a record of Snakemake's logger, if it is one that is shown."""
        event = str(getattr(record, "event", None) or "")
        handle = getattr(self, f"_{event}", None)
        if handle is not None:
            handle(record.__dict__)
        elif event in ("", "error"):
            self._words(record)

    def close(self) -> None:
        """Print the summary if jobs have run. Only once: logging calls this again at exit."""
        self._wipe()
        if self.closed or self.dryrun or not (self.jobs or self.failed):
            return
        self.closed = True
        took = _duration(self.now() - self.began)
        count = f"{self.done} of {self.total or len(self.jobs)} jobs done in {took}"
        if self.failed:
            self._line(f"{count}, {len(self.failed)} failed:")
            for job in self.failed[:MAX_FAILURES_LISTED]:
                self._line(f"  {job.name}: {job.log}")
            if len(self.failed) > MAX_FAILURES_LISTED:
                self._line(f"  and {len(self.failed) - MAX_FAILURES_LISTED} more")
            self._line("When this is fixed, the same command continues from here.")
        elif self.stopped:
            self._line(f"{count}, then stopped. The same command continues from here.")
        else:
            self._line(f"{count}.")

    # One method for each event of Snakemake. `take` finds it by the name of the event.

    def _run_info(self, data: Mapping[str, Any]) -> None:
        stats = data.get("stats") or {}
        self.total = stats.get("total", self.total)
        rules: Counter[str] = Counter()
        for rule, n in stats.items():
            if rule != "total":
                rules[family_of(rule)] += n
        if self.dryrun and not self.announced:
            self._line(_table(rules))
        elif not self.announced:
            most = ", ".join(f"{n} {rule}" for rule, n in rules.most_common(6))
            self._line(f"{self.total} jobs: {most}{', ...' if len(rules) > 6 else ''}")
        self.announced = True

    def _job_info(self, data: Mapping[str, Any]) -> None:
        job = _job(data)
        self.jobs[data["jobid"]] = self.running[data["jobid"]] = job
        self._progress({})

    def _job_finished(self, data: Mapping[str, Any]) -> None:
        self.running.pop(data["job_id"], None)

    def _progress(self, data: Mapping[str, Any]) -> None:
        self.done, self.total = data.get("done", self.done), data.get("total", self.total)
        if self.dryrun or not self.total:
            return
        took = self.now() - self.began
        what = ", ".join(Counter(job.rule for job in self.running.values()))
        line = f"{self.done}/{self.total} jobs, {_duration(took)}" + (f": {what}" if what else "")
        if self.live:
            self.stream.write(f"\r\x1b[K{line[:WIDTH]}")
            self.stream.flush()
            self.shown = True
        elif self.now() - self.last >= PROGRESS_SECONDS:
            self.last = self.now()
            self._line(line)

    def _job_error(self, data: Mapping[str, Any]) -> None:
        job = self.jobs.get(data["jobid"]) or _job(data)
        self.running.pop(data["jobid"], None)
        if self.stopped:
            return
        self.failed.append(job)
        if not _message(job.log):  # otherwise the job has printed its message
            self._line(f"{job.name}: ended without a message; it may have been killed. Its log: {job.log}")

    def _words(self, record: logging.LogRecord) -> None:
        """Print a message without an event, if it is an error, a warning or PASSED_ON."""
        text = str(record.msg or "").strip()
        if STOP_MESSAGE in text:
            self.stopped = True
            self._line("Stopping the running jobs.")
        elif record.levelno >= logging.ERROR:
            if not (JOB_ENDED.search(text) or SUPERFLUOUS.search(text)) and text:
                self._line(text)
        elif record.levelno >= logging.WARNING or PASSED_ON.search(text):
            self._line(JOB_HINT.sub("", BATCH_RULES.sub(_folded, text)))

    def _line(self, text: str) -> None:
        self._wipe()
        self.stream.write(f"{text}\n")
        self.stream.flush()

    def _wipe(self) -> None:
        if self.shown:
            self.stream.write("\r\x1b[K")
            self.shown = False


def _job(data: Mapping[str, Any]) -> Job:
    """The job that an event of Snakemake is about."""
    rule, logs = str(data["rule_name"]), [str(log) for log in data.get("log") or ()]
    words = [str(value) for value in dict(data.get("wildcards") or {}).values()]
    if (dataset := dataset_of(rule)) and logs:
        words = [dataset, Path(logs[0]).stem]
    return Job(family_of(rule), " ".join(words), ", ".join(logs))


def _table(rules: Mapping[str, int]) -> str:
    """A table of the number of jobs of each rule, in Snakemake's form."""
    width = max(map(len, [*rules, "total"]))
    lines = [f"{rule:<{width}}  {n:>7}" for rule, n in [*rules.items(), ("total", sum(rules.values()))]]
    return "\n".join(["Job stats:", f"{'job':<{width}}    count", f"{'-' * width}  -------", *lines])


def _folded(found: re.Match[str]) -> str:
    """A list of rules that BATCH_RULES has found, without data sets and batch numbers, each name once."""
    return ", ".join(dict.fromkeys(family_of(rule) for rule in found[0].split(", ")))


def _message(log: str) -> str:
    """The last error in a job's log, or "" if there is none."""
    try:
        with open(Path(log), "rb") as file:
            file.seek(0, 2)
            file.seek(max(0, file.tell() - TAIL_BYTES))
            found = MESSAGE.findall(file.read().decode(errors="replace"))
    except OSError:
        return ""
    return found[-1] if found else ""


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02} min"
    return f"{minutes} min {rest:02} s" if minutes else f"{rest} s"
