"""Fixtures that every stage's tests may use."""

import os
import shutil
import subprocess
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from hypothesis import HealthCheck, settings

from hobble.core.skeleton import Skeleton
from tests.checkout import Workflow, copy_of

# Each process of pytest has a core. More threads for matrix products would only wait for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")

BEGAN = time.monotonic()
ROOT = Path(__file__).resolve().parents[1]
collect_ignore = ["engine/bake_in_blender.py"]  # it runs in Blender

# A busy machine is no fault of the code: in a fresh clone the first text drawn takes seconds.
settings.register_profile("hobble", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("hobble")


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip a slow test that begins later than MINUTES after the start, where that is set."""
    minutes = float(os.environ.get("MINUTES", "inf"))
    if item.get_closest_marker("slow") and time.monotonic() > BEGAN + 60 * minutes:
        pytest.skip(f"a slow test, and {minutes:g} minutes are over")


@pytest.fixture(scope="session")
def root() -> Path:
    """The checkout."""
    return ROOT


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder with the reference data (motion, original rows, released network), if it is there."""
    folder = Path(os.environ.get("HOBBLE_SHARED", ROOT.parent / "shared"))
    if not (folder / "mocap" / "clips.csv").is_file():
        pytest.skip(f"no shared reference data at {folder} (set HOBBLE_SHARED to its folder)")
    return folder


@pytest.fixture(scope="session")
def holden31() -> Skeleton:
    """The 31-joint skeleton."""
    data = yaml.safe_load((ROOT / "config/skeletons/holden31.yaml").read_text())
    return Skeleton.from_dict({"name": "holden31", **{k: v for k, v in data.items() if k != "maps"}})


@pytest.fixture
def server() -> Iterator[SimpleNamespace]:
    """A server on the loopback address that serves `content`, and counts its `requests`.

    Each answer takes the next of `faults`: an error's status, or the bytes after which it breaks off.
    announces: whether it tells the size.
    """
    server = SimpleNamespace(content=b"", faults=list[int](), announces=True, requests=0)

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            server.requests += 1
            fault = server.faults.pop(0) if server.faults else 0
            if 400 <= fault < 600:
                return self.send_error(fault)
            self.send_response(200)
            if server.announces:
                self.send_header("Content-Length", str(len(server.content)))
            self.end_headers()
            self.wfile.write(server.content[: fault or None])
            self.close_connection = True
            return None

        def log_message(self, *_: object) -> None:
            pass

    http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=http.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    server.url = f"http://127.0.0.1:{http.server_port}/walk.bvh"
    yield server
    http.shutdown()
    http.server_close()
    thread.join()


@pytest.fixture
def workflow(root: Path, tmp_path: Path) -> Workflow:
    """A fresh copy with no results."""
    return copy_of(root, tmp_path)


RUN = "results/test/report.html"
LIMIT = 1200  # seconds that the shared run may take


def shared_folder(config: pytest.Config) -> Path:
    """A folder that all processes of this session share; HOBBLE_RUN: one that later sessions share, too."""
    if kept := os.environ.get("HOBBLE_RUN"):
        return Path(kept)
    base = config._tmp_path_factory.getbasetemp()  # type: ignore[attr-defined]
    return (base.parent if hasattr(config, "workerinput") else base) / "shared"


def pytest_collection_finish(session: pytest.Session) -> None:
    """Start the run of `test` that many tests look at, once for all processes, while other tests run."""
    worker = getattr(session.config, "workerinput", {}).get("workerid", "gw0")
    wanted = {"finished", "copied", "clips"}
    if worker != "gw0" or not any(wanted & set(getattr(i, "fixturenames", ())) for i in session.items):
        return
    folder = shared_folder(session.config)
    if folder.exists() or session.config.option.collectonly:  # HOBBLE_RUN has one, or no test runs
        return
    made = copy_of(ROOT, folder)
    script = '"$@" > said 2>&1; echo $? > status.part; mv status.part status'
    command = ["sh", "-c", script, "sh", *made.command("-c2", RUN, "-d", str(made.folder))]
    command += ["-s", str(made.folder / "Snakefile")]
    subprocess.Popen(command, **{**made.how(), "cwd": folder})


@pytest.fixture(scope="session")
def finished(request: pytest.FixtureRequest) -> Workflow:
    """The finished run of configuration `test`. Tests must not change it."""
    folder, began = shared_folder(request.config), time.monotonic()
    while not (folder / "status").exists():
        assert time.monotonic() < began + LIMIT, (folder / "said").read_text()
        time.sleep(0.2)
    assert (folder / "status").read_text() == "0\n", (folder / "said").read_text()
    return Workflow(folder / "checkout")


@pytest.fixture
def copied(finished: Workflow, tmp_path: Path) -> Workflow:
    """A copy of the finished run that a test may change. File times are kept, so nothing is out of date."""
    target = tmp_path / "copy"
    shutil.copytree(finished.folder, target / "checkout", symlinks=True)
    return Workflow(target / "checkout")
