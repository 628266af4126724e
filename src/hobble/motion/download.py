"""Downloads a clip and checks it. A download that fails is tried again."""

import hashlib
import http.client
import logging
import signal
import time
import urllib.error
import urllib.request
from pathlib import Path

from hobble.core.errors import InputError
from hobble.core.files import atomic_path, printable
from hobble.motion.read import MOST_BYTES

log = logging.getLogger("hobble.download")

ATTEMPTS = 5  # at most
PAUSE = 1.0  # seconds before the second attempt; doubled before each further one
TIMEOUT = 30.0  # seconds without data after which an attempt fails
DEADLINE = 600.0  # seconds for all attempts together; the workflow asks a cluster for as much time
RETRY_STATUS = {408, 425, 429, *range(500, 600)}  # HTTP statuses after which a retry may work


class _Failed(Exception):
    """A failed attempt: why, in words, and whether another attempt may succeed."""


def download_clip(url: str, path: str | Path, sha256: str, folder: str) -> int:
    """Download `url` to `path`. Returns the number of bytes. Must be called in the main thread.

    `path` is written only if the file is complete and its checksum is right.

    sha256: checksum of the file; "" if it is not known, so that any file is accepted. It may also be the
    checksum after \\r\\n at the ends of lines is changed to \\n, because version control may add the \\r.
    folder: where users can put the file themselves. The error message names it.

    Raises InputError with advice if no attempt succeeds.
    """

    def late(*_: object) -> None:
        raise _Failed(f"not done within {DEADLINE:g} seconds", False)

    # Only a signal ends an answer that comes byte by byte, whatever part of it the client waits for.
    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, DEADLINE)
    reasons: list[str] = []
    try:
        with atomic_path(path) as temporary:
            while True:
                try:
                    return temporary.write_bytes(_fetch(url, sha256))
                except _Failed as failure:
                    reason, again = failure.args
                    # The same wrong file twice is not damaged. It is another file.
                    again &= not (reason in reasons and "SHA-256" in reason)
                    reasons.append(reason)
                    if len(reasons) == ATTEMPTS or not again:
                        break
                log.info("%s: %s; trying again", url, reasons[-1])
                time.sleep(PAUSE * 2 ** (len(reasons) - 1))
            times = f", {len(reasons)} times" if len(reasons) > 1 else ""
            fix = f"Run the same command again later, or put {Path(path).name} into {folder} yourself."
            raise InputError(url, f"cannot be downloaded: {reasons[-1]}{times}", fix=fix)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _fetch(url: str, sha256: str) -> bytes:
    """The content of an address, with the checksum of `download_clip`. Raises _Failed."""
    request = urllib.request.Request(url, headers={"User-Agent": "hobble", "Accept-Encoding": "identity"})
    try:
        with urllib.request.urlopen(request, timeout=TIMEOUT) as answer:
            announced = answer.length or 0
            content: bytes = b"" if announced > MOST_BYTES else answer.read(MOST_BYTES + 1)
    except urllib.error.HTTPError as error:
        error.close()
        reason, again = f"the server says {error.code} {printable(error.reason)}", error.code in RETRY_STATUS
        raise _Failed(reason, again) from None
    except (OSError, http.client.HTTPException) as error:
        why = getattr(error, "reason", error)
        raise _Failed(f"the connection failed: {printable(why) or type(error).__name__}", True) from None
    if max(announced, len(content)) > MOST_BYTES:
        size = f"{MOST_BYTES / 1e6:g} MB, which is the most that a clip may be"
        raise _Failed(f"the file is larger than {size}", False)
    if len(content) < announced:
        raise _Failed(f"the file was cut short after {len(content)} of {announced} bytes", True)
    found = hashlib.sha256(content).hexdigest()
    if sha256 and sha256.lower() not in (found, hashlib.sha256(content.replace(b"\r\n", b"\n")).hexdigest()):
        problem = f"the server has another file: its SHA-256 is {found}, in the manifest it is {sha256}"
        raise _Failed(problem, True)
    return content
