"""Downloads a clip and checks it. A download that fails is tried again."""

from __future__ import annotations

import hashlib
import http.client
import logging
import signal
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path

from hobble.core.errors import InputError
from hobble.core.files import atomic_path
from hobble.core.untrusted import printable
from hobble.motion.read import MOST_BYTES

log = logging.getLogger("hobble.download")

ATTEMPTS = 5  # at most
PAUSE = 1.0  # seconds before the second attempt; doubled before each further one
TIMEOUT = 30.0  # seconds without data after which an attempt fails
DEADLINE = 600.0  # seconds for all attempts together; the workflow asks a cluster for as much time
RETRY_STATUS = {408, 425, 429, *range(500, 600)}  # HTTP statuses after which a retry may work


class _Failed(Exception):
    """A failed attempt. reason: in words. again: whether another attempt may succeed."""

    def __init__(self, reason: str, again: bool = True) -> None:
        super().__init__(reason)
        self.again = again


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
    """Download `url` to `path`. Returns the number of bytes. Must be called in the main thread.

    `path` is written only if the file is complete and its checksum is right.

    sha256: checksum of the file; "" if it is not known, so that any file is accepted. It may also be the
    checksum after \\r\\n at the ends of lines is changed to \\n, because version control may add the \\r.
    folder: where users can put the file themselves. The error message names it.

    attempts: how many are made at most. pause: seconds before the second attempt, doubled before each further
    one. timeout: seconds without data after which an attempt fails. deadline: seconds for all attempts
    together. most: size in bytes above which a file is refused. sleep: function that waits for a number of
    seconds.

    Raises InputError with advice if no attempt succeeds.
    """

    def late(*_: object) -> None:
        raise _Failed(f"not done within {deadline:g} seconds", again=False)

    # Only a signal ends an answer that comes byte by byte, whatever part of it the client waits for.
    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, deadline)
    reasons: list[str] = []
    try:
        with atomic_path(path) as temporary:
            while True:
                try:
                    content = _fetch(url, timeout, most)
                    _check(content, sha256)
                    return temporary.write_bytes(content)
                except _Failed as failure:
                    # The same wrong file twice is not damaged. It is another file.
                    same_file = str(failure) in reasons and "SHA-256" in str(failure)
                    reasons.append(str(failure))
                    if len(reasons) == attempts or same_file or not failure.again:
                        break
                log.info("%s: %s; trying again", url, reasons[-1])
                sleep(pause * 2 ** (len(reasons) - 1))
            times = f", {len(reasons)} times" if len(reasons) > 1 else ""
            fix = f"Run the same command again later, or put {Path(path).name} into {folder} yourself."
            raise InputError(url, f"cannot be downloaded: {reasons[-1]}{times}", fix=fix)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _fetch(url: str, timeout: float, most: int) -> bytes:
    """The content of an address. timeout, most: as in `download_clip`. Raises _Failed."""
    request = urllib.request.Request(url, headers={"User-Agent": "hobble", "Accept-Encoding": "identity"})
    try:
        with urllib.request.urlopen(request, timeout=timeout) as answer:
            announced = answer.length or 0
            content: bytes = b"" if announced > most else answer.read(most + 1)
            if max(announced, len(content)) > most:
                size = f"{most / 1e6:g} MB, which is the most that a clip may be"
                raise _Failed(f"the file is larger than {size}", again=False)
            if len(content) < announced:
                reason = f"the file was cut short after {len(content)} of {announced} bytes"
                raise _Failed(reason)
            return content
    except urllib.error.HTTPError as error:
        error.close()
        reason = f"the server says {error.code} {printable(error.reason)}"
        raise _Failed(reason, error.code in RETRY_STATUS) from None
    except TimeoutError:
        raise _Failed(f"no answer for {timeout:g} seconds") from None
    except urllib.error.URLError as error:
        why = getattr(error.reason, "strerror", None) or error.reason
        raise _Failed(f"the server cannot be reached ({printable(why)})") from None
    except (OSError, http.client.HTTPException) as error:
        raise _Failed(f"the connection broke off ({type(error).__name__})") from None


def _check(content: bytes, sha256: str) -> None:
    """Raise _Failed if a file's checksum is not `sha256`, from the data set's list of checksums."""
    found = hashlib.sha256(content).hexdigest()
    unix = hashlib.sha256(content.replace(b"\r\n", b"\n")).hexdigest()
    if sha256 and sha256.lower() not in (found, unix):
        raise _Failed(f"the server has another file: its SHA-256 is {found}, in the manifest it is {sha256}")
