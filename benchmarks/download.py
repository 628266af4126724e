"""Downloads by Hobble against pooch, from a server on this machine that breaks off like real ones.

    pip install pooch
    python benchmarks/download.py [--size-mb 20] [--rounds 5]

For each case it prints the bytes that the server sent and whether the file arrived. Both may try five times.
A dribbling server sends a byte every half second; the case ends after ten seconds. The last lines compare the
processor time of a download without faults (the fastest round, which includes the server's), and the lines of
code.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import http.server
import logging
import multiprocessing
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import hobble.motion.download as ours
from hobble.core.errors import HobbleError
from hobble.motion.download import download_clip

LONGEST = 10.0  # seconds of one case
BLOCK = 1 << 16


class Server(http.server.ThreadingHTTPServer):
    """Sends `content`. faults: for each request in turn how many bytes to send before it breaks off (None:
    all; "dribble": a byte every half second). sent: bytes in all."""

    daemon_threads = True

    def __init__(self, content: bytes, faults: list[int | str | None]) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.content, self.faults, self.sent = content, list(faults), 0
        threading.Thread(target=self.serve_forever, daemon=True).start()
        self.url = f"http://127.0.0.1:{self.server_port}/clip.bvh"

    def handle_error(self, *_: object) -> None:
        """A client that gives up is no error here."""


class Handler(http.server.BaseHTTPRequestHandler):
    """Answers one request. If the client asks for a part of the file, it sends that part."""

    server: Server

    def do_GET(self) -> None:
        """Send the file, or as much of it as the next fault lets through."""
        content = self.server.content
        first = int((self.headers.get("Range") or "bytes=0-")[6:-1])
        self.send_response(206 if first else 200)
        self.send_header("Content-Length", str(len(content) - first))
        if first:
            self.send_header("Content-Range", f"bytes {first}-{len(content) - 1}/{len(content)}")
        self.end_headers()
        fault = self.server.faults.pop(0) if self.server.faults else None
        stop = min(len(content), first + fault) if isinstance(fault, int) else len(content)
        size = 1 if fault == "dribble" else BLOCK
        for start in range(first, stop, size):
            self.wfile.write(content[start : min(start + size, stop)])
            self.server.sent += min(size, stop - start)
            if fault == "dribble":
                time.sleep(0.5)
        self.close_connection = True

    def log_message(self, *_: object) -> None:
        """Requests are not printed."""


def by_hobble(url: str, folder: Path, sha256: str, most: int) -> None:
    download_clip(url, folder / "clip.bvh", sha256, "clips", pause=0.01, deadline=LONGEST / 2, most=most)


def by_pooch(url: str, folder: Path, sha256: str, most: int) -> None:
    import pooch

    pooch.get_logger().setLevel(logging.ERROR)
    at, _, name = url.rpartition("/")
    fetcher = pooch.create(folder, at + "/", registry={name: sha256}, retry_if_failed=4)
    fetcher.fetch(name)


def tried(way: Callable, content: bytes, faults: list[int | str | None], most: int = 1 << 40) -> str:
    """What the server sent, and what came of it. The download runs in a process that can be ended."""
    server, sha256 = Server(content, faults), hashlib.sha256(content).hexdigest()
    with tempfile.TemporaryDirectory() as folder:
        job = multiprocessing.get_context("fork").Process(
            target=_quietly, args=(way, server.url, Path(folder), sha256, most)
        )
        job.start()
        job.join(LONGEST)
        waits = job.is_alive()
        job.kill()
        job.join()
        there = (Path(folder) / "clip.bvh").exists()
    server.shutdown()
    outcome = "still waiting" if waits else "arrived" if there else "refused"
    return f"{server.sent / len(content):5.2f} of the file sent, {outcome}"


def _quietly(way: Callable, *arguments: object) -> None:
    with contextlib.suppress(HobbleError, OSError, ValueError):
        way(*arguments)


def processor_seconds(way: Callable, content: bytes, rounds: int) -> float:
    """Of the fastest download without faults."""
    server, sha256 = Server(content, []), hashlib.sha256(content).hexdigest()
    best = float("inf")
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            before = time.process_time()
            way(server.url, Path(folder), sha256, 1 << 40)
            best = min(best, time.process_time() - before)
    server.shutdown()
    return best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--size-mb", type=int, default=20)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    content = bytes(range(256)) * (options.size_mb * 4096)
    part = len(content) // 4
    ways = {"Hobble": by_hobble, "pooch": by_pooch}
    cases: dict[str, tuple] = {
        "breaks off after a quarter, three times": ([part, part, part],),
        "dribbles": (["dribble"] * 9,),
        "is four times larger than allowed": ([], part),
    }
    for case, arguments in cases.items():
        for name, way in ways.items():
            print(f"{case:42} {name:8} {tried(way, content, *arguments)}")
    seconds = {name: processor_seconds(way, content, options.rounds) for name, way in ways.items()}
    print(f"processor time without faults, Hobble's to pooch's: {seconds['Hobble'] / seconds['pooch']:.2f}")
    print("lines of hobble.motion.download:", len(Path(ours.__file__).read_text("utf-8").splitlines()))


if __name__ == "__main__":
    main()
