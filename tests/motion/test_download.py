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
def fetch(server, tmp_path: Path, monkeypatch) -> Callable[..., bytes]:
    """Download what the server has. `waits`: the pauses; nothing but the whole file is left."""
    path, waits = tmp_path / "kept/walk.bvh", list[float]()

    def run(url: str = "") -> bytes:
        server.content = server.content or CONTENT
        try:
            download_clip(url or server.url, path, SHA256, "data/mine")
        finally:
            assert set(path.parent.iterdir()) <= {path}
        return path.read_bytes()

    run.waits, run.path = waits, path
    monkeypatch.setattr(module.time, "sleep", waits.append)
    return run


@pytest.mark.parametrize(
    ("faults", "announces", "waits"),
    [
        ([], True, []),
        ([503, 500], True, [1, 2]),
        ([70_000, 50_000], True, [1, 2]),
        ([70_000], False, [1]),  # its checksum shows that it was cut
    ],
)
def test_a_download_with_faults_becomes_complete(server, fetch, faults, announces, waits):
    """Its lines may also end with \\r\\n, which version control adds."""
    server.faults, server.announces = faults, announces
    server.content = CONTENT if announces else CONTENT.replace(b"\n", b"\r\n")
    assert fetch() == server.content
    assert fetch.waits == waits


def test_a_wrong_checksum_is_refused(server, fetch):
    server.content = CONTENT + b"."
    other = hashlib.sha256(server.content).hexdigest()
    with pytest.raises(InputError, match=f"its SHA-256 is {other}, in the manifest it is {SHA256}"):
        fetch()
    assert server.requests == 2
    assert not fetch.path.exists()


@pytest.mark.parametrize(
    ("status", "most", "said", "waits"),
    [
        (404, 10**6, r"cannot be downloaded: the server says 404 Not Found\. Run", []),
        (500, 10**6, "500 Internal Server Error, 5 times", [1, 2, 4, 8]),
        (0, 50_000, r"larger than 0\.05 MB, which is the most that a clip may be", []),
    ],
)
@pytest.mark.parametrize("announces", [True, False])
def test_a_file_that_is_not_served_or_too_large_is_refused(
    server, fetch, monkeypatch, status, most, said, waits, announces
):
    monkeypatch.setattr(module, "MOST_BYTES", most)
    server.faults, server.announces = [status] * 9, announces
    with pytest.raises(InputError, match=said):
        fetch()
    assert (server.requests, fetch.waits) == (len(waits) + 1, waits)
    assert not fetch.path.exists()


def test_without_a_network_the_message_says_so(fetch):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with pytest.raises(InputError, match=r"connection failed: .*, 5 times\. .*put walk\.bvh into data/mine"):
        fetch(f"http://127.0.0.1:{port}/walk.bvh")


ANSWER = b"HTTP/1.1 200 OK\r\n"


def babble(listener: socket.socket, begin: bytes, more: bytes) -> None:
    """Answer with `begin`, and then `more` a hundred times a second until the client closes."""
    with contextlib.suppress(OSError):
        connection, _ = listener.accept()
        connection.recv(10_000)
        connection.sendall(begin)
        while True:
            connection.sendall(more)
            time.sleep(0.01)


@pytest.mark.parametrize(
    ("begin", "more"),
    [(b"", b"H"), (ANSWER, b"X"), (ANSWER + b"Content-Length: 9999\r\n\r\n", b"1")],
    ids=["before it answers", "in its headers", "in the file"],
)
def test_a_server_that_sends_too_slowly_is_given_up(fetch, monkeypatch, begin: bytes, more: bytes):
    monkeypatch.setattr(module, "DEADLINE", 0.3)
    listener, before = socket.create_server(("127.0.0.1", 0)), time.monotonic()
    threading.Thread(target=babble, args=(listener, begin, more), daemon=True).start()
    with pytest.raises(InputError, match=r"cannot be downloaded: not done within 0\.3 seconds"):
        fetch(f"http://127.0.0.1:{listener.getsockname()[1]}/walk.bvh")
    assert time.monotonic() - before < 3
    assert signal.getitimer(signal.ITIMER_REAL) == (0, 0)
