"""Keeps what a job has made of each clip, so that the job makes only what is missing or has changed.

Snakemake deletes the outputs of a job before it runs and after it fails. So each finished file gets a second
name (a hard link, which takes no space) in results/datasets/<dataset>/.made/<rule>/, and for each clip a
record is written there: a fingerprint of all that the files depend on, their checksums and the seconds that
they took. The folder .made can be deleted at any time. This costs only the time to make the files again.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from hobble.core.files import write_error
from hobble.workflow.checksums import file_crc32

FOLDER = ".made"  # in the folder of a data set


def fingerprint(params: Mapping[str, Any], inputs: Iterable[tuple[str, str]], outputs: Iterable[str]) -> str:
    """Hash of everything that some output files depend on.

    params: plain values, among them the fingerprint of the code. inputs: (file name, SHA-256) of each input,
    in order. outputs: the paths of the files.
    """
    dependencies = [params, list(inputs), [str(_kept_folder(Path(path), "")[1]) for path in outputs]]
    return hashlib.sha256(json.dumps(dependencies, sort_keys=True).encode()).hexdigest()


class KeptFiles:
    """The kept files of one rule. rule: its name without data set and number, such as motion_clips."""

    def __init__(self, rule: str) -> None:
        self.rule = rule

    def take(self, key: str, outputs: Iterable[str]) -> bool:
        """Put kept files at the paths `outputs` if their fingerprint is `key` and they are undamaged.

        Returns whether they were put there. Raises HobbleError if a file cannot be put in its place.
        """
        pairs = [(self._kept(path), Path(path)) for path in outputs]
        record = _read_record(_record_file(pairs[0][0]))
        if record.get("fingerprint") != key:
            return False
        with contextlib.suppress(OSError):
            if record["files"] == [file_crc32(kept) for kept, _ in pairs]:
                for kept, path in pairs:
                    try:
                        _link(kept, path)
                    except OSError as error:
                        raise write_error(error, path) from error
                return True
        return False

    def keep(self, key: str, outputs: Iterable[str], seconds: float) -> None:
        """Keep finished outputs. On a full disk nothing is kept, and no error is raised.

        key: the fingerprint of the outputs. seconds: the time it took to make them.
        """
        pairs = [(self._kept(path), Path(path)) for path in outputs]
        record_file = _record_file(pairs[0][0])
        with contextlib.suppress(OSError):
            record_file.unlink(missing_ok=True)
            for kept, path in pairs:
                _link(path, kept)
            files = [file_crc32(path) for _, path in pairs]
            record = {"fingerprint": key, "files": files, "seconds": round(seconds, 3)}
            with _replaced(record_file) as temporary:
                temporary.write_text(json.dumps(record), encoding="utf-8")

    def _kept(self, path: str) -> Path:
        """Where the output `path` is kept."""
        root, below = _kept_folder(Path(path), self.rule)
        return root / below


def recorded_seconds(folder: Path) -> float:
    """Seconds that the kept files of a rule took to make. folder: results/.../.made/<rule>."""
    return sum(float(_read_record(path).get("seconds", 0.0)) for path in folder.rglob(".*.kept"))


def _kept_folder(path: Path, rule: str) -> tuple[Path, Path]:
    """The folder in which a path's data set keeps files of `rule`, and the path within the data set."""
    parts = path.parts
    root = max(n for n in range(1, len(parts)) if parts[n - 1 : n + 1] == ("results", "datasets")) + 2
    return Path(*parts[:root], FOLDER, rule), Path(*parts[root:])


def _record_file(kept: Path) -> Path:
    """The record of a clip. kept: the path of its first kept file."""
    return kept.with_name(f".{kept.stem}.kept")


def _read_record(path: Path) -> dict[str, Any]:
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) and {"fingerprint", "files"} <= record.keys() else {}


def _link(source: Path, target: Path) -> None:
    """Give a file a second name, or copy it where the file system has no hard links."""
    with _replaced(target) as temporary:
        try:
            os.link(source, temporary)
        except FileNotFoundError:
            raise
        except OSError:
            shutil.copyfile(source, temporary)


@contextlib.contextmanager
def _replaced(target: Path) -> Iterator[Path]:
    """Yield a temporary path that replaces `target`. A killed process leaves no half-written file.

    Unlike `hobble.core.files.atomic_path` it does not flush to disk: files lost in a power cut are made
    again.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    temporary.unlink(missing_ok=True)
    try:
        yield temporary
        os.replace(temporary, target)
    finally:
        # os.replace does nothing if both paths are names of the same file.
        temporary.unlink(missing_ok=True)
