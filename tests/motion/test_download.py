"""Downloads from a server on the loopback address that fails like real servers."""

import contextlib
import hashlib
import signal
import socket
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from hobble.core.errors import InputError
from hobble.motion import download as module
from hobble.motion.download import download_clip

CONTENT = b"HIERARCHY\n" + bytes(range(48, 58)) * 20_000 + b"\n"
SHA256 = hashlib.sha256(CONTENT).hexdigest()


@pytest.fixture
def fetch(server, tmp_path: Path, monkeypatch) -> Callable[..., Path]:
    def run() -> Path:
        path = tmp_path / "kept/walk.bvh"
        server.content = server.content or CONTENT
        download_clip(server.url, path, SHA256, "data/mine")
        return path

    run.waits = []
    run.folder = tmp_path / "kept"
    monkeypatch.setattr(module.time, "sleep", run.waits.append)
    return run


def test_a_downloaded_file_is_complete_and_no_partial_file_is_left(server, fetch):
    path = fetch()
    assert path.read_bytes() == CONTENT
    assert [p.name for p in path.parent.iterdir()] == ["walk.bvh"]  # no part is left
    assert (server.requests, fetch.waits) == (1, [])


@pytest.mark.parametrize(
    ("faults", "announces", "waits"),
    [
        ([503, 500], True, [1, 2]),
        ([70_000, 50_000], True, [1, 2]),
        ([70_000], False, [1]),  # its checksum shows that it was cut
    ],
)
def test_a_download_with_faults_becomes_complete(server, fetch, faults, announces, waits):
    server.faults, server.announces = faults, announces
    assert fetch().read_bytes() == CONTENT
    assert fetch.waits == waits


def test_checksum_lists_may_have_either_line_ending(server, fetch):
    server.content = CONTENT.replace(b"\n", b"\r\n")
    assert fetch().read_bytes() == server.content


def test_a_wrong_checksum_is_refused_and_the_file_is_deleted(server, fetch):
    server.content = CONTENT + b"."
    found = hashlib.sha256(server.content).hexdigest()
    with pytest.raises(InputError) as refused:
        fetch()
    assert str(refused.value) == (
        f"{server.url}: cannot be downloaded: the server has another file: its SHA-256 is {found}, in the "
        f"manifest it is {SHA256}, 2 times. Run the same command again later, or "
        "put walk.bvh into data/mine yourself."
    )
    assert list(fetch.folder.iterdir()) == []
    assert server.requests == 2


@pytest.mark.parametrize(
    ("status", "said", "requests", "waits"),
    [
        (404, r"cannot be downloaded: the server says 404 Not Found\. Run", 1, []),
        (500, "500 Internal Server Error, 5 times", 5, [1, 2, 4, 8]),
    ],
)
def test_a_file_that_is_not_served_is_refused(server, fetch, status, said, requests, waits):
    server.faults = [status] * 9
    with pytest.raises(InputError, match=said):
        fetch()
    assert (server.requests, fetch.waits) == (requests, waits)


def test_without_a_network_the_message_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(module.time, "sleep", lambda seconds: None)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with pytest.raises(InputError, match=r"connection failed: .*, 5 times\. .*put walk\.bvh into data/mine"):
        download_clip(f"http://127.0.0.1:{port}/walk.bvh", tmp_path / "walk.bvh", SHA256, "data/mine")


ANSWER = b"HTTP/1.1 200 OK\r\n"


class Babbler(threading.Thread):
    """A server that sends `begin`, and then `more` a hundred times a second until the client closes."""

    def __init__(self, begin: bytes, more: bytes) -> None:
        super().__init__(daemon=True)
        self.begin, self.more = begin, more
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self.socket.getsockname()[1]}/walk.bvh"
        self.start()

    def run(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                connection, _ = self.socket.accept()
                with connection, contextlib.suppress(OSError):
                    connection.recv(10_000)
                    connection.sendall(self.begin)
                    while True:
                        connection.sendall(self.more)
                        time.sleep(0.01)


@pytest.mark.parametrize(
    ("begin", "more"),
    [(b"", b"H"), (ANSWER, b"X"), (ANSWER + b"Content-Length: 9999\r\n\r\n", b"1")],
    ids=["before it answers", "in its headers", "in the file"],
)
def test_a_server_that_sends_too_slowly_is_given_up(tmp_path, monkeypatch, begin: bytes, more: bytes):
    monkeypatch.setattr(module, "DEADLINE", 0.3)
    before = time.monotonic()
    with pytest.raises(InputError, match=r"cannot be downloaded: not done within 0\.3 seconds"):
        download_clip(Babbler(begin, more).url, tmp_path / "walk.bvh", SHA256, "data/mine")
    assert time.monotonic() - before < 3
    assert signal.getitimer(signal.ITIMER_REAL) == (0, 0)


@pytest.mark.parametrize("announces", [True, False])
def test_a_file_that_is_too_large_is_refused_and_deleted(server, fetch, monkeypatch, announces: bool):
    monkeypatch.setattr(module, "MOST_BYTES", 50_000)
    server.announces = announces
    with pytest.raises(InputError, match=r"larger than 0\.05 MB, which is the most that a clip may be"):
        fetch()
    assert list(fetch.folder.iterdir()) == []
    assert server.requests == 1
