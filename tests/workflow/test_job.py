"""The context of a job's script: what a user sees when the job fails."""

import subprocess
import sys

import pytest

SCRIPT = """
from types import SimpleNamespace
from hobble.core.errors import InputError
from hobble.workflow.job import job
with job(SimpleNamespace(log=[{log!r}], rule="stage")) as log:
    log.info("words for the log")
    {body}
"""


def ended(log: str, body: str) -> subprocess.CompletedProcess:
    script = SCRIPT.format(log=log, body=body)
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)


def test_an_error_is_one_message_even_if_the_log_cannot_be_written() -> None:
    end = ended("/dev/full", "raise InputError('clip.bvh', 'is torn')")
    assert end.returncode == 1
    assert end.stderr.strip() == "stage: clip.bvh: is torn."


@pytest.mark.parametrize("log", ["/dev/full", "/proc/nowhere/job.log"])
def test_a_job_continues_even_if_the_log_cannot_be_written(log: str) -> None:
    end = ended(log, "print('done')")
    assert (end.returncode, end.stdout, end.stderr) == (0, "done\n", "")


def test_disk_errors_are_not_reported_as_bugs(tmp_path) -> None:
    end = ended(str(tmp_path / "job.log"), "open('/proc/1/nowhere')")
    assert end.returncode == 1
    assert end.stderr.startswith("stage: /proc/1/nowhere: No such file or directory. See ")
    assert "Traceback" in (tmp_path / "job.log").read_text()


def test_a_bug_writes_its_traceback_only_to_the_log(tmp_path) -> None:
    path = tmp_path / "logs" / "job.log"
    end = ended(str(path), "{}['left knee']")
    assert end.returncode == 1
    assert "KeyError: 'left knee'" in end.stderr
    assert "Traceback" not in end.stderr
    text = path.read_text()
    assert "words for the log" in text
    assert "Traceback" in text
