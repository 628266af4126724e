"""A scratch folder with one undisturbed run, and every job of it ready to be run again on its own.

While the workflow runs, each job's script is kept as Snakemake wrote it, with all that the rule gives it. So
a job can be run again in a fraction of a second, in a fork of this process, which has imported all of it.
"""

from __future__ import annotations

import importlib
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .same import same
from .values import not_finite

ROOT = Path(__file__).resolve().parents[2]
NOBODY = 65534
FETCHED = ("page_bundle",)  # it asks the npm registry, and reads what it gave
PREAMBLE_END = "######## snakemake preamble end #########"
# Put on the path of every job as sitecustomize: keeps the scripts that Snakemake makes for its jobs.
KEEP = """
import os, shutil, sys
if "/.snakemake/scripts/" in sys.orig_argv[-1]:
    shutil.copy(sys.orig_argv[-1], os.environ["KEPT_SCRIPTS"])
"""


@dataclass(frozen=True)
class Job:
    """One job as Snakemake ran it; paths are relative to the run's folder."""

    rule: str
    source: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    log: str

    @property
    def name(self) -> str:
        return f"{self.rule} ({Path(self.outputs[0]).name})"


@dataclass(frozen=True)
class End:
    """How a job ended: its status (negative: the signal), its output, and how long it took."""

    status: int
    said: str
    seconds: float


def tracked() -> list[Path]:
    """The tracked files of the checkout, relative to it. A fresh clone consists of them."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    return [Path(name) for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()]


def clone(folder: Path, package: Path | None = ROOT / "src") -> None:
    """A fresh clone of the checkout, as it is now, in a new folder.

    package: the folder of the package, which is linked, so that its compiled code is found; None copies it.
    """
    folder.mkdir(parents=True)
    for name in tracked():
        if package is None or name.parts[0] != "src":
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    if package is not None:
        (folder / "src").symlink_to(package)


class Lab:
    """folder/run: a clone of the checkout, where the undisturbed run takes place.

    fresh: the clone has its own copy of the package, with nothing compiled yet.
    """

    def __init__(self, folder: Path, *, fresh: bool = False) -> None:
        self.folder = folder
        self.run = folder / "run"
        self.kept = folder / "kept"
        self.targets: tuple[str, ...] = ()
        self.jobs: list[Job] = []
        self.seconds: dict[str, float] = {}
        self.not_finite: set[str] = set()  # what is NaN in the undisturbed run, such as an unknown landing
        for part in (self.kept, folder / "site"):
            part.mkdir(parents=True)
        clone(self.run, None if fresh else ROOT / "src")
        (folder / "site/sitecustomize.py").write_text(KEEP)

    def command(self, *arguments: str) -> list[str]:
        """The README's command, with the environment's programs on the path: `snakemake -c2 results/...`."""
        return ["snakemake", *arguments]

    def environment(self, keep: bool = False) -> dict[str, str]:
        """A user's environment variables: the programs on the path use the package of the clone."""
        path = [str(self.run / "src"), *([str(self.folder / "site")] if keep else [])]
        programs = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        own = {"PYTHONPATH": os.pathsep.join(path), "PYTHONDONTWRITEBYTECODE": "1", "PATH": programs}
        return {**os.environ, **own, "KEPT_SCRIPTS": str(self.kept)}

    def snakemake(self, folder: Path, *arguments: str, keep: bool = False) -> End:
        began = time.monotonic()
        done = subprocess.run(
            self.command(*arguments), cwd=folder, env=self.environment(keep), capture_output=True, text=True
        )
        return End(done.returncode, done.stdout + done.stderr, time.monotonic() - began)

    def undisturbed(self, *targets: str) -> None:
        """Run the workflow once and keep its jobs. Then each job is run again alone and must give the
        same.
        """
        self.targets = targets
        end = self.snakemake(self.run, "-c2", *targets, keep=True)
        assert end.status == 0, end.said
        kept = (_job(file.read_text()) for file in self.kept.iterdir())
        self.jobs = sorted((job for job in kept if job.rule not in FETCHED), key=lambda job: job.outputs)
        self.not_finite = set(not_finite(self.run / "results"))
        for job in self.jobs:
            _import(job.source)
        for job in self.jobs:
            with self.bench(job) as bench:
                end = bench.run(after=self._tell_modules)
                self._import_told()
                assert end.status == 0, (job.name, end.said)
                assert (differs := bench.unlike()) == [], (job.name, differs)
                self.seconds[job.name] = end.seconds

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
        folder = Path(tempfile.mkdtemp(prefix="bench-", dir=self.folder))
        try:
            clone(folder / "run", self.run / "src")
            bench = Bench(self, job, folder / "run")
            bench.fill()
            yield bench
        finally:
            shutil.rmtree(folder, ignore_errors=True)


class Bench:
    """One job and its inputs, in a folder where they may be damaged."""

    def __init__(self, lab: Lab, job: Job, folder: Path) -> None:
        self.lab, self.job, self.folder = lab, job, folder

    def fill(self) -> None:
        """Copy the job's inputs from the undisturbed run."""
        for path in self.artefacts:
            _copy(self.lab.run / path, self.folder / path)
        (self.folder / "results").mkdir(parents=True, exist_ok=True)

    @property
    def artefacts(self) -> list[str]:
        """Inputs that other jobs made."""
        return [path for path in self.job.inputs if path.startswith("results/")]

    def run(self, **how: Any) -> End:
        """Run the job to its end. how: as in `forked`."""
        return forked(self.job, self.folder, **how)

    def unlike(self) -> list[str]:
        """Outputs that differ from those of the undisturbed run in more than times."""
        pairs = ((path, self.folder / path, self.lab.run / path) for path in self.job.outputs)
        return [path for path, here, there in pairs if not same(here, there)]


def forked(
    job: Job,
    folder: Path,
    *,
    kill_after: float | None = None,
    before: Callable[[], None] | None = None,
    after: Callable[[], None] | None = None,
    meanwhile: Callable[[], None] | None = None,
    limit: float = 300.0,
) -> End:
    """Run a job's script in a child; kill it after some seconds.

    before, after: called in the child, first and last. meanwhile: called in this process while it runs.
    """
    began = time.monotonic()
    with tempfile.TemporaryFile() as said:
        pid = os.fork()
        if not pid:
            _child(job, folder, said.fileno(), before, after)
        if meanwhile is not None:
            meanwhile()
        status = _wait(pid, began + (limit if kill_after is None else kill_after))
        said.seek(0)
        text = said.read().decode(errors="replace")
    return End(os.waitstatus_to_exitcode(status), text, time.monotonic() - began)


def _child(
    job: Job,
    folder: Path,
    said: int,
    before: Callable[[], None] | None,
    after: Callable[[], None] | None,
) -> None:
    code = 1
    try:
        os.setsid()
        os.chdir(folder)
        os.dup2(said, 1)
        os.dup2(said, 2)
        sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
        if before is not None:
            before()
        exec(compile(job.source, f"<{job.rule}>", "exec"), {"__name__": "__main__", "__file__": "script"})
        if after is not None:
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


def _wait(pid: int, until: float) -> int:
    while True:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            return status
        if time.monotonic() >= until:
            with suppress(ProcessLookupError):  # killed before it led a group of its own
                os.killpg(pid, signal.SIGKILL)
            os.kill(pid, signal.SIGKILL)
            return os.waitpid(pid, 0)[1]
        time.sleep(min(0.005, max(0.0, until - time.monotonic())))


def _job(source: str) -> Job:
    names: dict[str, Any] = {"__name__": "preamble", "__file__": "script"}
    path = list(sys.path)
    exec(source[: source.index(PREAMBLE_END)], names)
    sys.path[:] = path
    given = names["snakemake"]
    return Job(
        given.rule, source, tuple(map(str, given.input)), tuple(map(str, given.output)), str(given.log[0])
    )


def _import(source: str) -> None:
    for name in re.findall(r"^(?:from|import) (hobble[\w.]*|torch|yaml)", source, re.M):
        importlib.import_module(name)


def _copy(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.is_dir():
        shutil.copytree(source, target)
    else:
        shutil.copy2(source, target)
