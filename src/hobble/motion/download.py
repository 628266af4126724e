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
from hobble.core.files import failed_write_error, sync_folder
from hobble.core.untrusted import printable
from hobble.motion.read import MOST_BYTES

log = logging.getLogger("hobble.download")

ATTEMPTS = 5  # at most
PAUSE = 1.0  # seconds before the second attempt; doubled before each further one
TIMEOUT = 30.0  # seconds without data after which an attempt fails
DEADLINE = 600.0  # seconds for all attempts together; the workflow asks a cluster for as much time
BLOCK = 1 << 16  # bytes that are read at a time
LENGTH = re.compile(r"\d{1,18}")  # a valid header Content-Length
RETRY_STATUS = {408, 425, 429, *range(500, 600)}  # HTTP statuses after which a retry may work


class _Failed(Exception):
    """A failed attempt. reason: in words. again: whether another attempt may succeed."""

    def __init__(self, reason: str, again: bool = True) -> None:
        super().__init__(reason)
        self.again = again


class _TooLate(Exception):
    """The time for all attempts is over."""


class _OtherFile(_Failed):
    """A file with the wrong checksum. If the same file arrives twice, it is not damaged but another one."""


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

    sha256: checksum of the file; "" if it is not known, so that any file is accepted. It may also be the
    checksum after \\r\\n at the ends of lines is changed to \\n, because version control may add the \\r.
    folder: where users can put the file themselves. The error message names it.

    attempts: how many are made at most. pause: seconds before the second attempt, doubled before each further
    one. timeout: seconds without data after which an attempt fails. deadline: seconds for all attempts
    together. most: size in bytes above which a file is refused. sleep: function that waits for a number of
    seconds.

    Raises InputError with advice if no attempt succeeds.
    """
    path = Path(path)
    part = path.with_name(f".{path.name}.part")
    wrong_files: set[str] = set()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with _time_limit(deadline):
            for attempt in range(attempts):
                try:
                    _fetch(url, part, timeout, most)
                    _check(part, sha256)
                    return _move_into_place(part, path)
                except _Failed as failure:
                    last_failure = failure
                # The message of an _OtherFile contains the checksum, so an equal message means the same file.
                same_file_again = str(last_failure) in wrong_files
                if attempt + 1 == attempts or not last_failure.again or same_file_again:
                    break
                if isinstance(last_failure, _OtherFile):
                    wrong_files.add(str(last_failure))
                log.info("%s: %s; trying again", url, last_failure)
                sleep(pause * 2**attempt)
    except _TooLate:
        last_failure = _Failed(f"not done within {deadline:g} seconds")
    except OSError as error:
        raise failed_write_error(error, path) from error
    raise _download_error(url, path, folder, str(last_failure), attempt + 1)


@contextlib.contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """Raise _TooLate after so many seconds, whatever the server does.

    Outside the main thread there is no limit, because Python allows signal handlers only in the main thread.
    """

    def late(*_: object) -> None:
        raise _TooLate

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    old_handler = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, old_handler)


def _move_into_place(part: Path, path: Path) -> int:
    """Rename the complete file `part` to `path`, safely on disk. Returns its number of bytes."""
    with open(part, "rb") as file:
        os.fsync(file.fileno())
        size = os.fstat(file.fileno()).st_size
    os.replace(part, path)
    sync_folder(path.parent)
    return size


def _download_error(url: str, path: Path, folder: str, reason: str, attempts: int) -> HobbleError:
    """The error for a download that failed. reason: of the last failure, in words."""
    times = f", {attempts} times" if attempts > 1 else ""
    return InputError(
        url,
        f"cannot be downloaded: {reason}{times}",
        fix=f"Run the same command again later, or put {path.name} into {folder} yourself.",
    )


def _fetch(url: str, part: Path, timeout: float, most: int) -> None:
    """Download what is missing in the file `part`, or everything if the server cannot resume.

    timeout, most: as in `download_clip`.
    """
    have = part.stat().st_size if part.is_file() else 0
    headers = {"User-Agent": "hobble", "Accept-Encoding": "identity"}
    if have:
        headers["Range"] = f"bytes={have}-"
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=timeout) as answer:
            is_part = answer.status == 206  # else the server sends the whole file
            if is_part and not _starts_at(answer.headers.get("Content-Range"), have):
                part.unlink()
                raise _Failed("the server sent the wrong part of the file")
            with open(part, "ab" if is_part else "wb") as file:
                _copy(answer, file, have if is_part else 0, timeout, most)
    except urllib.error.HTTPError as error:
        error.close()
        if error.code == 416 and have:  # `part` is already complete, or too long: its checksum will tell
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
    """Whether a header Content-Range, such as "bytes 100-199/200", begins at this byte.

    Some servers write "bytes=".
    """
    return (content_range or "").replace("=", " ").startswith(f"bytes {byte}-")


def _copy(answer: http.client.HTTPResponse, file: BinaryIO, have: int, timeout: float, most: int) -> None:
    """Write the body of the server's answer to the end of the file.

    Raises _Failed if the file is shorter than announced, or larger than `most` bytes. A file that is too
    large is deleted. have: number of bytes that the file already has.
    """
    length = answer.headers.get("Content-Length") or ""
    announced = int(length) if LENGTH.fullmatch(length) else None
    received = 0
    if have + (announced or 0) > most:
        _refuse_too_large(file, most)
    while block := _read_block(answer, timeout):
        received += len(block)
        if have + received > most:
            _refuse_too_large(file, most)
        file.write(block)
    if announced is not None and received < announced:
        raise _Failed(f"the file was cut short after {have + received} of {have + announced} bytes")


def _refuse_too_large(file: BinaryIO, most: int) -> NoReturn:
    """Delete the file and raise _Failed."""
    file.truncate(0)
    os.unlink(file.name)
    raise _Failed(
        f"the file is larger than {most / 1e6:g} MB, which is the most that a clip may be", again=False
    )


def _read_block(answer: http.client.HTTPResponse, timeout: float) -> bytes:
    """The next bytes of the answer, or b"" at its end."""
    try:
        return answer.read1(BLOCK)  # returns what has arrived, without waiting for a full block
    except TimeoutError:
        raise _Failed(f"no answer for {timeout:g} seconds") from None
    except (OSError, http.client.HTTPException) as error:
        raise _Failed(f"the connection broke off ({type(error).__name__})") from None


def _check(part: Path, sha256: str) -> None:
    """Delete the file and raise _OtherFile if its checksum is not `sha256`.

    sha256: as in `download_clip`, from the manifest, the data set's list of checksums.
    """
    if not sha256:
        return
    data = part.read_bytes()
    found = hashlib.sha256(data).hexdigest()
    if sha256.lower() in (found, hashlib.sha256(data.replace(b"\r\n", b"\n")).hexdigest()):
        return
    part.unlink()
    raise _OtherFile(f"the server has another file: its SHA-256 is {found}, in the manifest it is {sha256}")
