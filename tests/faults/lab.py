"""One undisturbed run. Each job's script is kept as Snakemake wrote it, and can be run again in a fork."""

from __future__ import annotations

import importlib
import os
import shutil
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.checkout import copy_of
from tests.conftest import ROOT

from .damage import not_finite
from .same import same

FETCHED = ("page_bundle",)  # it asks the npm registry, and reads what it gave
PREAMBLE_END = "######## snakemake preamble end #########"
# Put on the path of every job as sitecustomize: keeps the scripts that Snakemake makes for its jobs.
KEEP = """
import shutil, sys
if "/.snakemake/scripts/" in sys.orig_argv[-1]:
    shutil.copy(sys.orig_argv[-1], {kept!r})
"""


@dataclass(frozen=True)
class Job:
    """One job as Snakemake ran it; paths are relative to the run's folder."""

    rule: str
    source: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    @property
    def name(self) -> str:
        return f"{self.rule} ({Path(self.outputs[0]).name})"

    @property
    def artefacts(self) -> list[str]:
        """Inputs that other jobs made."""
        return [path for path in self.inputs if path.startswith("results/")]


@dataclass(frozen=True)
class End:
    """How a job ended: its status (negative: the signal), and its output."""

    status: int
    said: str


class Lab:
    """Runs the workflow once and keeps its jobs. Then each job is run again alone and must give the same."""

    def __init__(self, folder: Path, *targets: str) -> None:
        self.folder, kept, site = folder, folder / "kept", folder / "site"
        for part in (kept, site):
            part.mkdir(parents=True)
        (site / "sitecustomize.py").write_text(KEEP.format(kept=str(kept)))
        whole = copy_of(ROOT, folder, site)
        whole.run("-c2", *targets)
        self.run = whole.folder
        jobs = (_job(file.read_text()) for file in kept.iterdir())
        self.jobs = sorted((job for job in jobs if job.rule not in FETCHED), key=lambda job: job.outputs)
        # What is NaN in the undisturbed run, such as an unknown landing.
        self.not_finite = set(not_finite(self.run / "results"))
        for job in self.jobs:
            with self.bench(job) as bench:
                end = bench.run(after=self._tell_modules)
                assert end.status == 0, (job.name, end.said)
                assert bench.unlike() == [], job.name
            self._import_told()

    def _tell_modules(self) -> None:
        (self.folder / "modules").write_text("\n".join(sys.modules))

    def _import_told(self) -> None:
        """What a job imports on its way: a user who may not read this Python's folder could not."""
        for name in (self.folder / "modules").read_text().split():
            with suppress(Exception):
                importlib.import_module(name)

    @contextmanager
    def bench(self, job: Job) -> Iterator[Bench]:
        """A folder of its own with the job's inputs. It is removed afterwards."""
        with tempfile.TemporaryDirectory(prefix="bench-", dir=self.folder) as folder:
            bench = Bench(self, job, copy_of(ROOT, Path(folder)).folder)
            bench.fill()
            yield bench


class Bench:
    """One job and its inputs, in a folder where they may be damaged."""

    def __init__(self, lab: Lab, job: Job, folder: Path) -> None:
        self.lab, self.job, self.folder = lab, job, folder

    def fill(self) -> None:
        """Copy the job's inputs from the undisturbed run, in place of what is there."""
        for path in self.job.artefacts:
            here = self.folder / path
            here.parent.mkdir(parents=True, exist_ok=True)
            if (self.lab.run / path).is_dir():
                shutil.rmtree(here, ignore_errors=True)
                shutil.copytree(self.lab.run / path, here)
            else:
                shutil.rmtree(here, ignore_errors=True)
                shutil.copy2(self.lab.run / path, here)
        (self.folder / "results").mkdir(exist_ok=True)

    def without_outputs(self) -> None:
        """Remove the outputs, as Snakemake does before a job."""
        for path in self.job.outputs:
            made = self.folder / path
            if made.is_dir():
                shutil.rmtree(made, ignore_errors=True)
            else:
                made.unlink(missing_ok=True)

    def unlike(self) -> list[str]:
        """Outputs that differ from those of the undisturbed run in more than times."""
        return [path for path in self.job.outputs if not same(self.folder / path, self.lab.run / path)]

    def run(
        self,
        before: Callable[[], Any] = lambda: None,
        after: Callable[[], Any] = lambda: None,
        meanwhile: Callable[[], Any] = lambda: None,
    ) -> End:
        """Run the job's script in a fork, `before` and `after` it there, and `meanwhile` in this process."""
        with tempfile.TemporaryFile() as said:
            pid = os.fork()
            if not pid:
                self._in_fork(said.fileno(), before, after)
            meanwhile()
            status = os.waitpid(pid, 0)[1]
            with suppress(ProcessLookupError):
                os.killpg(pid, signal.SIGKILL)  # what a killed job had started
            said.seek(0)
            return End(os.waitstatus_to_exitcode(status), said.read().decode(errors="replace"))

    def _in_fork(self, said: int, before: Callable[[], Any], after: Callable[[], Any]) -> None:
        code = 1
        try:
            os.setsid()
            os.chdir(self.folder)
            os.dup2(said, 1)
            os.dup2(said, 2)
            sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
            before()
            script = compile(self.job.source, f"<{self.job.rule}>", "exec")
            exec(script, {"__name__": "__main__", "__file__": "script"})
            after()
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 1
        except BaseException:
            traceback.print_exc()
        finally:
            for stream in (sys.stdout, sys.stderr):
                stream.flush()
            os._exit(code)


def _job(source: str) -> Job:
    names: dict[str, Any] = {"__name__": "preamble", "__file__": "script"}
    path = list(sys.path)
    exec(source[: source.index(PREAMBLE_END)], names)
    sys.path[:] = path
    given = names["snakemake"]
    return Job(given.rule, source, tuple(map(str, given.input)), tuple(map(str, given.output)))
