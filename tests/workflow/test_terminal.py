"""The terminal output of a run: one line of progress, each failure once, a summary at the end."""

import io
import logging
from pathlib import Path

import pytest

import snakemake_logger_plugin_hobble as plugin
from snakemake_logger_plugin_hobble import PROGRESS_SECONDS, Terminal

CALLED = "RuleException:\nCalledProcessError in file x.smk, line 3:\nCommand 'set -euo pipefail; python s.py'"


class Run:
    """A terminal, its clock, and records as Snakemake makes them."""

    def __init__(self, live: bool = False, dryrun: bool = False) -> None:
        self.clock, self.out = 0.0, io.StringIO()
        self.terminal = Terminal(self.out, live, dryrun, now=lambda: self.clock)

    def say(
        self, event: str | None, text: str | None = "", level: int = logging.INFO, **data: object
    ) -> None:
        record = logging.LogRecord("snakemake", level, "", 0, text, None, None)
        record.__dict__.update(data)
        if event is not None:
            record.event = event
        self.terminal.show_record(record)

    def job(self, number: int, rule: str, log: str = "", reason: str = "", **wildcards: str) -> None:
        self.say("job_info", jobid=number, rule_name=rule, wildcards=wildcards, log=[log], reason=reason)

    def finish(self, number: int, done: int, total: int) -> None:
        self.say("job_finished", job_id=number)
        self.say("progress", None, done=done, total=total)

    @property
    def lines(self) -> list[str]:
        return self.out.getvalue().splitlines()


def test_a_run_prints_its_plan_some_progress_and_a_summary_once() -> None:
    run = Run()
    run.say(None, "Building DAG of jobs...")
    run.say("run_info", "Job stats:\n...", stats={"motion_clips": 30, "training": 1, "total": 31})
    for number in range(30):
        run.clock += 1
        run.job(number, "motion_clips", clip=f"walk-{number}")
        run.finish(number, number + 1, 31)
    run.job(30, "training", configuration="holden")
    run.clock += 170
    run.finish(30, 31, 31)
    run.terminal.close()
    assert run.lines[:2] == ["31 jobs: 30 motion_clips, 1 training", "29/31 jobs, 30 s: motion_clips"]
    assert run.lines[-1] == "31 of 31 jobs done in 3 min 20 s."
    assert len(run.lines) <= 2 + 200 / PROGRESS_SECONDS


def test_a_failure_is_printed_once_and_listed_in_the_summary(tmp_path: Path) -> None:
    said, silent = tmp_path / "said.log", tmp_path / "silent.log"
    said.write_text("2026-01-01 00:00:00,000 INFO x\n2026-01-01 00:00:00,000 ERROR a.bvh: is torn\n")
    silent.write_text("2026-01-01 00:00:00,000 INFO x\n")
    run = Run()
    run.say("run_info", "", stats={"motion_clips": 2, "total": 2})
    for number, log in enumerate((said, silent)):
        run.job(number, "motion_clips", str(log), clip="ab"[number])
        run.say("error", CALLED, logging.ERROR)
        run.say("job_error", "", logging.ERROR, jobid=number, rule_name="motion_clips", log=[log])
    run.say("error", "WorkflowError:\nconfig/nope.yaml: no such file", logging.ERROR)
    run.say(None, "Exiting because a job execution failed. Look below for error messages", logging.ERROR)
    run.terminal.close()
    assert run.lines[1:] == [
        f"motion_clips b: ended without a message; it may have been killed. Its log: {silent}",
        "WorkflowError:",
        "config/nope.yaml: no such file",
        "0 of 2 jobs done in 0 s, 2 failed:",
        f"  motion_clips a: {said}",
        f"  motion_clips b: {silent}",
        "When this is fixed, the same command continues from here.",
    ]


def test_a_dry_run_lists_its_jobs_by_stage_with_reasons(monkeypatch: pytest.MonkeyPatch) -> None:
    told = []
    monkeypatch.setattr(plugin, "ABOUT_PLAN", [lambda jobs: told.append(jobs) or ["It takes long."]])
    run = Run(dryrun=True)
    stats = {"training": 1, "motion_clips": 2, "total": 3}
    run.say("run_info", "Job stats: ...", stats=stats)
    for batch in ("00", "01"):
        reason = f"Missing output files: results/{batch}; Input files updated by another job: x"
        log = f"results/datasets/d/logs/motion/motion_clips/{batch}.log"
        run.job(int(batch), "motion_clips", log, reason=reason, batch=batch)
    reason = "Input files updated by another job: y, z"
    run.job(2, "training", "results/c/logs/training/training.log", reason=reason, configuration="c")
    run.say("run_info", "Job stats: ...", stats=stats)
    run.say(None, "Reasons:\n    (check individual jobs above for details)\n    code: training")
    run.terminal.close()
    assert run.lines == [
        "Job stats:",
        "stage     job           count  reason",
        "motion    motion_clips      2  Missing output files (results/00)",
        "training  training          1  Input files updated by another job (y)",
        "total                       3",
        "It takes long.",
    ]
    assert told == [
        [*(("motion_clips", {"batch": b}) for b in ("00", "01")), ("training", {"configuration": "c"})]
    ]


def test_a_long_job_shows_its_share_its_errors_and_its_log_while_the_time_moves(tmp_path: Path) -> None:
    log = tmp_path / "training.log"
    run = Run()
    run.say("run_info", "", stats={"training": 1, "total": 65})
    run.finish(0, 51, 65)
    run.job(1, "training", str(log), configuration="holden")
    for said in ("begin", "pass 1: 34 % done, 8 min left, error 0.41", "pass 2: 36 % done, 7 min left"):
        with log.open("a") as file:
            file.write(f"2026-01-01 00:00:00,000 INFO {said}\n")
        run.clock += PROGRESS_SECONDS
        run.terminal.tick()
    assert run.lines[1:] == [
        f"training holden: its log is {log}",
        "51/65 jobs, 30 s: training",
        "51/65 jobs, 1 min: training holden 34 % done, 8 min left, error 0.41",
        "51/65 jobs, 1 min 30 s: training holden 36 % done, 7 min left",
    ]
