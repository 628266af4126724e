"""Keeps the files that a job has made of each clip, so that a later try makes only missing or changed ones.

Snakemake deletes all outputs of a job before the job runs and after it fails. So each finished file gets a
second name (a hard link, which takes no space) in results/datasets/<dataset>/.made/<rule>/. For each clip, a
record in this folder holds a fingerprint of all that the clip's files depend on, the checksums of the files,
and the seconds that it took to make them. The folder .made can be deleted at any time. The next jobs then
make the files again.
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

from hobble.core.files import failed_write_error
from hobble.workflow.checksums import file_crc32

FOLDER = ".made"  # in the folder of a data set


def fingerprint(params: Mapping[str, Any], inputs: Iterable[tuple[str, str]], outputs: Iterable[str]) -> str:
    """Hash of everything that the output files of one clip depend on.

    params: plain values, among them the fingerprint of the code. inputs: (file name, SHA-256) of each input,
    in order. outputs: the paths of the output files.
    """
    output_names = [str(_kept_folder(Path(path), "")[1]) for path in outputs]  # relative to the data set
    dependencies = [params, list(inputs), output_names]
    return hashlib.sha256(json.dumps(dependencies, sort_keys=True).encode()).hexdigest()


class KeptFiles:
    """The kept files of one rule. rule: its name without data set and batch number, such as motion_clips."""

    def __init__(self, rule: str) -> None:
        self.rule = rule

    def restore(self, key: str, outputs: Iterable[str]) -> bool:
        """Put kept files at the paths `outputs` if their fingerprint is `key` and they are undamaged.

        Returns whether the files were put there. Raises HobbleError if an output cannot be written.
        """
        pairs = [(self._kept_path(path), Path(path)) for path in outputs]
        record = _read_record(_record_file(pairs[0][0]))
        if record.get("fingerprint") != key:
            return False
        with contextlib.suppress(OSError):
            if record["files"] == [file_crc32(kept) for kept, _ in pairs]:
                for kept, path in pairs:
                    try:
                        _link(kept, path)
                    except OSError as error:
                        raise failed_write_error(error, path) from error
                return True
        return False

    def keep(self, key: str, outputs: Iterable[str], seconds: float) -> None:
        """Keep the finished outputs of one clip. If this fails, as on a full disk, no error is raised.

        key: the fingerprint of the outputs. seconds: the time it took to make them.
        """
        pairs = [(self._kept_path(path), Path(path)) for path in outputs]
        record_file = _record_file(pairs[0][0])
        with contextlib.suppress(OSError):
            record_file.unlink(missing_ok=True)
            for kept, path in pairs:
                _link(path, kept)
            files = [file_crc32(path) for _, path in pairs]
            record = {"fingerprint": key, "files": files, "seconds": round(seconds, 3)}
            with _replacing(record_file) as temporary:
                temporary.write_text(json.dumps(record), encoding="utf-8")

    def _kept_path(self, path: str) -> Path:
        """The path under which the output `path` is kept."""
        folder, relative_path = _kept_folder(Path(path), self.rule)
        return folder / relative_path


def recorded_seconds(folder: Path) -> float:
    """How many seconds it took to make the kept files of a rule. folder: results/.../.made/<rule>."""
    return sum(float(_read_record(path).get("seconds", 0.0)) for path in folder.rglob(".*.kept"))


def _kept_folder(path: Path, rule: str) -> tuple[Path, Path]:
    """(the folder for the kept files of `rule`, `path` relative to its data set's folder)."""
    parts = path.parts
    # Number of parts up to the last results/datasets/<dataset> in the path.
    count = max(n for n in range(1, len(parts)) if parts[n - 1 : n + 1] == ("results", "datasets")) + 2
    return Path(*parts[:count], FOLDER, rule), Path(*parts[count:])


def _record_file(kept: Path) -> Path:
    """The path of a clip's record. kept: the path of the clip's first kept file."""
    return kept.with_name(f".{kept.stem}.kept")


def _read_record(path: Path) -> dict[str, Any]:
    """The record's keys `fingerprint`, `files` (CRC-32 of each) and `seconds`; {} if it cannot be read."""
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) and {"fingerprint", "files"} <= record.keys() else {}


def _link(source: Path, target: Path) -> None:
    """Give a file a second name, or copy it where the file system has no hard links."""
    with _replacing(target) as temporary:
        try:
            os.link(source, temporary)
        except FileNotFoundError:
            raise  # `source` is missing
        except OSError:
            shutil.copyfile(source, temporary)


@contextlib.contextmanager
def _replacing(target: Path) -> Iterator[Path]:
    """Yield the path of a temporary file, which then replaces `target`.

    So `target` is never half-written, even if the process is killed. Unlike `hobble.core.files.atomic_path`,
    this does not flush the file to disk: if a power cut destroys it, a job makes it again.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    temporary.unlink(missing_ok=True)
    try:
        yield temporary
        os.replace(temporary, target)
    finally:
        # If both paths are names of the same file, os.replace does nothing, and `temporary` still exists.
        temporary.unlink(missing_ok=True)
