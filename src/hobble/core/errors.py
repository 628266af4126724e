"""Errors that a user can mend. The message names the file, the place in it, and what to do."""

import sys
import tempfile
import traceback
from pathlib import Path


class HobbleError(Exception):
    """An error caused by the user's input. Its text is the whole message; no traceback is shown."""


def unforeseen(error: Exception, log: str | Path) -> str:
    """One line for an error that nobody foresaw. log: the file that has its traceback."""
    reason = " ".join(str(error).split())
    return (
        f"{type(error).__name__}: {reason:.500}. This is a bug in Hobble, not a fault in your data. "
        f"Please report it with the log {log}"
    )


def keep_traceback(error: Exception, what: str = "") -> str:
    """Write the traceback of an error that nobody foresaw into a log file. Returns the line for the user.

    what: what failed, such as "walk.bvh: ".
    """
    with tempfile.NamedTemporaryFile("w", prefix="hobble-", suffix=".log", delete=False) as file:
        file.write(f"{' '.join(sys.argv)}\n{''.join(traceback.format_exception(error))}")
    return f"{what}{unforeseen(error, file.name)}"


class InputError(HobbleError):
    """Something is wrong with a file.

    problem: what is wrong, without a final dot. line, frame: where in the file, if known. fix: a sentence
    that says what to do.

    >>> str(InputError("walk.bvh", "rotation is NaN", line=12, fix="Export the clip again."))
    'walk.bvh, line 12: rotation is NaN. Export the clip again.'
    """

    def __init__(
        self,
        path: str | Path,
        problem: str,
        *,
        line: int | None = None,
        frame: int | None = None,
        fix: str | None = None,
    ) -> None:
        self.path, self.problem, self.line, self.frame, self.fix = path, problem, line, frame, fix
        place = str(path)
        if line is not None:
            place += f", line {line}"
        if frame is not None:
            place += f", frame {frame}"
        text = f"{place}: {problem.rstrip('.')}."
        super().__init__(f"{text} {fix}" if fix else text)
