"""The context of a job's script: what a user sees when the job fails."""

import subprocess
import sys

import pytest

from hobble.core.errors import InputError
from hobble.workflow.job import with_true_advice

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


@pytest.mark.parametrize("log", ["/dev/full", "/proc/nowhere/job.log"])
def test_a_job_continues_even_if_the_log_cannot_be_written(log: str) -> None:
    end = ended(log, "print('done')")
    assert (end.returncode, end.stdout, end.stderr) == (0, "done\n", "")
    end = ended(log, "raise InputError('clip.bvh', 'is torn')")
    assert (end.returncode, end.stderr.strip()) == (1, "stage: clip.bvh: is torn.")


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


AGAIN = "; the same command makes it again."
ADVICE = {
    "results/d/database/plain/statistics.npz": f"Delete results/d/database/plain{AGAIN}",
    "results/c/network/weights.npz": f"Delete results/c/network/weights.npz{AGAIN}",
    "data/heights.npz": "Replace it by a good copy.",
    "results/c/checkpoints/0/checkpoint.npz": "Delete it; the next run makes it again.",
}


def test_the_advice_to_delete_names_what_a_rule_makes() -> None:
    inputs = ["results/d/database/plain", "results/c/network/weights.npz", "data/heights.npz"]
    for path, advice in ADVICE.items():
        error = InputError(path, "damaged", line=3, fix="Delete it; the next run makes it again.")
        assert str(with_true_advice(error, inputs)) == f"{path}, line 3: damaged. {advice}"
    other = InputError("a.bvh", "too short", fix="Use a longer clip.")
    assert with_true_advice(other, inputs) is other
