"""Downloads a clip and checks it. A download that fails is tried again and resumes where it stopped."""

from __future__ import annotations

import contextlib
import hashlib
import http.client
import logging
import os
import re
import signal
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO, NoReturn

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import sync_folder, write_error
from hobble.core.untrusted import printable
from hobble.motion.read import MOST_BYTES

log = logging.getLogger("hobble.download")

ATTEMPTS = 5  # at most
PAUSE = 1.0  # seconds before the second attempt; doubled before each further one
TIMEOUT = 30.0  # seconds without data
DEADLINE = 600.0  # seconds for all attempts; the workflow's rule asks a cluster for as much time
BLOCK = 1 << 16  # bytes that are read at a time
LENGTH = re.compile(r"\d{1,18}")  # a valid header Content-Length
RETRY_STATUS = {408, 425, 429, *range(500, 600)}  # HTTP statuses after which a retry may work


class _Failed(Exception):
    """A failed attempt. again: whether another attempt may succeed."""

    def __init__(self, reason: str, again: bool = True) -> None:
        super().__init__(reason)
        self.again = again


class _TooLate(Exception):
    """The time for all attempts is over."""


class _OtherFile(_Failed):
    """The file has the wrong checksum. If it arrives twice, the server really has another file."""


def download_clip(
    url: str,
    path: str | Path,
    sha256: str,
    folder: str,
    *,
    attempts: int = ATTEMPTS,
    pause: float = PAUSE,
    timeout: float = TIMEOUT,
    deadline: float = DEADLINE,
    most: int = MOST_BYTES,
    sleep: Callable[[float], object] = time.sleep,
) -> int:
    """Download `url` to `path`. Returns the number of bytes.

    `path` is written only if the checksum is right. Until the data are complete, they are in a hidden file
    beside `path`, from which this or a later call resumes.

    sha256: checksum of the file. It may also be the checksum after \\r\\n at the ends of lines is changed to
    \\n, because version control may add the \\r. folder: where users can put the file themselves, for the
    message.

    attempts: how many are made at most. pause: seconds before the second attempt. timeout: seconds without
    data after which an attempt fails. deadline: seconds for all attempts. most: bytes; a larger file is not
    kept. sleep: function that waits for a number of seconds.

    Raises InputError with advice if no attempt succeeds.
    """
    path = Path(path)
    part = path.with_name(f".{path.name}.part")
    wrong_files: set[str] = set()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with _at_most(deadline):
            for attempt in range(attempts):
                try:
                    _fetch(url, part, timeout, most)
                    _check(part, sha256)
                    return _keep(part, path)
                except _Failed as failure:
                    last = failure
                if attempt + 1 == attempts or not last.again or str(last) in wrong_files:
                    break
                if isinstance(last, _OtherFile):
                    wrong_files.add(str(last))
                log.info("%s: %s; trying again", url, last)
                sleep(pause * 2**attempt)
    except _TooLate:
        last = _Failed(f"not done within {deadline:g} seconds")
    except OSError as error:
        raise write_error(error, path) from error
    raise _refusal(url, path, folder, str(last), attempt + 1)


@contextlib.contextmanager
def _at_most(seconds: float) -> Iterator[None]:
    """Raise _TooLate after so many seconds, whatever the server does. Works only in the main thread."""

    def late(*_: object) -> None:
        raise _TooLate

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _keep(part: Path, path: Path) -> int:
    """Rename the complete file `part` to `path`. Returns its number of bytes."""
    with open(part, "rb") as file:
        os.fsync(file.fileno())
        size = os.fstat(file.fileno()).st_size
    os.replace(part, path)
    sync_folder(path.parent)
    return size


def _refusal(url: str, path: Path, folder: str, reason: str, attempts: int) -> HobbleError:
    times = f", {attempts} times" if attempts > 1 else ""
    return InputError(
        url,
        f"cannot be downloaded: {reason}{times}",
        fix=f"Run the same command again later, or put {path.name} into {folder} yourself.",
    )


def _fetch(url: str, part: Path, timeout: float, most: int) -> None:
    """Download what is missing in the file `part`, or everything if the server cannot resume."""
    have = part.stat().st_size if part.is_file() else 0
    headers = {"User-Agent": "hobble", "Accept-Encoding": "identity"}
    if have:
        headers["Range"] = f"bytes={have}-"
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=timeout) as answer:
            goes_on = answer.status == 206 and _starts_at(answer.headers.get("Content-Range"), have)
            if answer.status == 206 and not goes_on:
                part.unlink()
                raise _Failed("the server sent the wrong part of the file")
            with open(part, "ab" if goes_on else "wb") as file:
                _copy(answer, file, have if goes_on else 0, timeout, most)
    except urllib.error.HTTPError as error:
        error.close()
        if error.code == 416 and have:  # `part` is complete already, or too long
            return
        raise _Failed(
            f"the server says {error.code} {printable(error.reason)}", error.code in RETRY_STATUS
        ) from None
    except TimeoutError:
        raise _Failed(f"no answer for {timeout:g} seconds") from None
    except urllib.error.URLError as error:
        reason = getattr(error.reason, "strerror", None) or error.reason
        raise _Failed(f"the server cannot be reached ({printable(reason)})") from None
    except http.client.HTTPException as error:
        raise _Failed(f"the answer makes no sense ({type(error).__name__})") from None


def _starts_at(content_range: str | None, byte: int) -> bool:
    return (content_range or "").replace("=", " ").startswith(f"bytes {byte}-")


def _copy(answer: http.client.HTTPResponse, file: BinaryIO, have: int, timeout: float, most: int) -> None:
    """Write the answer's body.

    Raises _Failed if the file is shorter than announced, or larger than `most` bytes. A file that is too
    large is deleted. have: number of bytes that the file already has.
    """
    length = answer.headers.get("Content-Length") or ""
    announced = int(length) if LENGTH.fullmatch(length) else None
    came = 0
    if have + (announced or 0) > most:
        _too_large(file, most)
    while block := _block(answer, timeout):
        came += len(block)
        if have + came > most:
            _too_large(file, most)
        file.write(block)
    if announced is not None and came < announced:
        raise _Failed(f"the file was cut short after {have + came} of {have + announced} bytes")


def _too_large(file: BinaryIO, most: int) -> NoReturn:
    file.truncate(0)
    os.unlink(file.name)
    raise _Failed(f"it is larger than {most / 1e6:g} MB, which is the most that a clip may be", again=False)


def _block(answer: http.client.HTTPResponse, timeout: float) -> bytes:
    try:
        return answer.read1(BLOCK)  # returns what has arrived, without waiting for a full block
    except TimeoutError:
        raise _Failed(f"no answer for {timeout:g} seconds") from None
    except (OSError, http.client.HTTPException) as error:
        raise _Failed(f"the connection broke off ({type(error).__name__})") from None


def _check(part: Path, sha256: str) -> None:
    """Delete the file and raise _OtherFile if its checksum is not `sha256`, which is from the manifest."""
    data = part.read_bytes()
    found = hashlib.sha256(data).hexdigest()
    if sha256.lower() in (found, hashlib.sha256(data.replace(b"\r\n", b"\n")).hexdigest()):
        return
    part.unlink()
    raise _OtherFile(f"the server has another file: its SHA-256 is {found}, in the manifest it is {sha256}")
