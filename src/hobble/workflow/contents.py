"""Hashes of the user's files, so that jobs run again when the content of a file changes, whatever its time.

Snakemake compares times: it does not see another file with an older time (`cp -p`). So the rules that read
the user's files have their hashes as a param. A file is hashed again only if its size, times or inode have
changed. Nobody can set the time of its last change of any kind (ctime) back.
"""

import atexit
import contextlib
import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path

from hobble.core.errors import HobbleError
from hobble.core.files import write_text

KNOWN = Path(".snakemake/hobble-contents.json")  # path of a file -> [its stamp, its hash]
HASH_DIGITS = 16


def stamp(path: str | Path) -> list[int]:
    """Size, times of the last change of content and of any kind (ns), and inode of a file."""
    status = os.stat(path)
    return [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]


class Contents:
    """The hashes of the user's files. made: the folder of files that are downloaded, which have checksums."""

    def __init__(self, made: Path, known: Path = KNOWN) -> None:
        self.made, self.file = f"{made}/", known
        self.known: dict[str, list] = {}
        self.changed = False
        atexit.register(self.keep)
        with contextlib.suppress(OSError, ValueError):
            found = json.loads(known.read_text(encoding="utf-8"))
            self.known = found if isinstance(found, dict) else {}

    def of(self, paths: Iterable[str]) -> list[str]:
        """Path and hash of each of these files that the user gives, for a rule's params."""
        given = [path for path in map(str, paths) if not path.startswith(("results/", self.made))]
        return [f"{path} {self._hash(path)}" for path in given if os.path.isfile(path)]

    def keep(self) -> None:
        """Write the hashes, for the next run."""
        if self.changed:
            with contextlib.suppress(HobbleError):  # a folder that cannot be written
                write_text(self.file, json.dumps(self.known))

    def _hash(self, path: str) -> str:
        try:
            now = stamp(path)
            if path not in self.known or self.known[path][0] != now:
                with open(path, "rb") as file:
                    digest = hashlib.file_digest(file, "sha256").hexdigest()[:HASH_DIGITS]
                self.known[path], self.changed = [now, digest], True
            return str(self.known[path][1])
        except (OSError, LookupError, TypeError):
            return "cannot be read"  # no error here: the job that reads the file says why
