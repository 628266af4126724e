"""Reads label files beside clips (`.phase`, `.gait`, `_footsteps.txt`, `_gait.txt`) and writes the last two.

In these files, frames are counted from 1, at the frame rate of the clip's BVH file (the source file). A clip
has 60 frames a second, and its frames are counted from 0. Errors name the label file and the line.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hobble.core.errors import InputError
from hobble.core.files import MAX_TEXT_BYTES, read_text
from hobble.core.quat import Array
from hobble.labels.clip_labels import GAITS, Labels

FILE_GAITS = ("stand", "walk", "jog", "run", "crouch", "jump", "crawl", "unknown")  # columns of `.gait`
# Gait that only files name -> gait of GAITS.
GAIT_OF_FILE_GAIT = {"run": "jog", "crawl": "crouch", "unknown": "bump"}
LONGEST_LINE = 1024  # bytes; a line of eight shares with all their digits has about 200


@dataclass(frozen=True)
class SourceTime:
    """Converts frames of the clip's source file to frames of the clip, and back.

    frames: number of frames of the source file. fps: its frame rate. first: the source frame, counted from 0,
    at which the clip begins.
    """

    frames: int
    fps: float
    first: int = 0

    @property
    def ratio(self) -> float:
        """Number of source frames in the time of one frame of the clip."""
        return self.fps / 60.0

    def to_clip_frame(self, number: float) -> float:
        """The frame of the clip, not rounded, at the source frame `number`, which is counted from 1."""
        return (number - 1 - self.first) / self.ratio

    def source_frames_of_clip(self, frames: int) -> Array:
        """(frames,) the source frame, counted from 0 and not rounded, at each frame of the clip."""
        return np.arange(frames) * self.ratio + self.first


def whole_frame(frame: float) -> int:
    """The first whole frame at or after `frame`. Rounding errors are ignored.

    So frame n of a 120 Hz file, counted from 1, becomes frame n // 2 of the clip, counted from 0.
    """
    return math.ceil(frame - 1e-6)


def read_phase(path: Path, time: SourceTime, frames: int) -> Array:
    """(frames,) the phase in each frame of the clip, from a file with one value for each source frame.

    Between two values the phase is interpolated the shorter way round the cycle. Raises InputError for a
    value that is not a number in 0..1, and for a wrong number of rows.
    """
    rows = np.unwrap(_read_matrix(path, time, 1)[:, 0], period=1.0)
    phase = np.interp(time.source_frames_of_clip(frames), np.arange(len(rows)), rows) % 1.0
    return np.where(phase > 1 - 1e-9, 0.0, phase)


def read_gait(path: Path, time: SourceTime, frames: int) -> Array:
    """(frames, 6) gait shares from a file with the 8 columns FILE_GAITS. Raises like `read_phase`."""
    rows = _read_matrix(path, time, len(FILE_GAITS))
    # (8, 6): which of GAITS each column adds to.
    added = np.eye(len(GAITS))[[GAITS.index(GAIT_OF_FILE_GAIT.get(name, name)) for name in FILE_GAITS]]
    when, row = time.source_frames_of_clip(frames), np.arange(len(rows))
    return np.stack([np.interp(when, row, column) for column in rows.T], axis=1) @ added


def read_footsteps(path: Path, time: SourceTime) -> Array:
    """(N, 3) footsteps (see `hobble.labels.phase`) from a file with lines `right left` or `right left *`.

    `right` and `left` are the frames in which the feet land. `*` marks a row whose cycle must not be used.
    The last line may hold only `right`. Then it counts as marked with `*`, because the code of Holden et al.
    (2017) does not use the cycle that ends with this landing. The phase before the landing is known
    nevertheless. Raises InputError, which names the line, if frames are not numbers, do not rise, or are past
    the clip's end.
    """
    steps: list[tuple[float, float, float]] = []
    last = 0.0  # the frame of the landing before
    short_line = 0  # number of the line that holds only one frame; 0: none yet
    for number, words in _read_lines(path, time):
        if short_line:
            fix = "Write `right left`: the frames in which the right and the left foot land."
            problem = "only the last line may hold one frame instead of two"
            raise InputError(path, problem, line=short_line, fix=fix)
        marked = words[-1] == "*"
        texts = words[:-1] if marked else words
        if not 1 <= len(texts) <= 2:
            fix = "Write the frames in which the right and the left foot land, such as `120 151`."
            problem = f"has {len(texts)} frame numbers, but a line holds `right left` or `right left *`"
            raise InputError(path, problem, line=number, fix=fix)
        landings = []
        for text in texts:
            landings.append(last := _later_frame(path, number, text, last, time))
        short_line = number if len(landings) == 1 else 0
        right, left = (time.to_clip_frame(x) for x in (*landings, math.nan)[:2])
        steps.append((right, left, float(marked or short_line > 0)))
    return np.array(steps, float).reshape(-1, 3)


def _later_frame(path: Path, line: int, word: str, last: float, time: SourceTime) -> float:
    """The frame that a word stands for. Raises InputError if it does not follow `last` or is past the end."""
    frame = _parse_number(path, line, word)
    if frame <= last:
        fix = "Write the frames in rising order, beginning with 1 or more."
        raise InputError(path, f"frame {frame:g} does not come after {last:g}", line=line, fix=fix)
    if frame > time.frames + 1:
        problem = f"frame {frame:g} lies past the clip's last frame, {time.frames}"
        raise InputError(path, problem, line=line)
    return frame


def read_gait_keys(path: Path, time: SourceTime, frames: int) -> Array:
    """(frames, 6) gait shares from a file with keys. A key is a line `frame gait`.

    Between two keys with different gaits, the shares fade linearly. A fade ends one frame before the second
    key, as in the `.gait` files of Holden et al. (2017). Raises InputError, which names the line, if frames
    are not numbers, do not rise, or are past the clip's end, and for an unknown gait.
    """
    names = (*FILE_GAITS, "bump")
    keys: list[tuple[float, int]] = []
    for number, words in _read_lines(path, time):
        if len(words) != 2:
            problem = f"has {len(words)} words, but a line holds `frame gait`, such as `120 walk`"
            raise InputError(path, problem, line=number)
        frame = _later_frame(path, number, words[0], keys[-1][0] if keys else -math.inf, time)
        if words[1] not in names:
            fix = f"There are {', '.join(names)}."
            raise InputError(path, f"no such gait: {words[1]!r}", line=number, fix=fix)
        keys.append((frame, GAITS.index(GAIT_OF_FILE_GAIT.get(words[1], words[1]))))
    if not keys:
        fix = "Write lines of `frame gait`, such as `1 walk`, or remove the file."
        raise InputError(path, "holds no keys", fix=fix)
    key_frames, gait = np.array(keys).T
    when = time.source_frames_of_clip(frames) + 1
    following = np.clip(np.searchsorted(key_frames, when, side="right"), 1, max(len(key_frames) - 1, 1))
    shares = np.eye(len(GAITS))[gait.astype(int)]
    if len(key_frames) == 1:
        return np.repeat(shares, frames, axis=0)
    start, end = key_frames[following - 1], key_frames[following] - 1
    fade = np.clip((when - start) / np.maximum(end - start, 1e-9), 0.0, 1.0)[:, None]
    return (1 - fade) * shares[following - 1] + fade * shares[following]


def _read_lines(path: Path, time: SourceTime) -> Iterator[tuple[int, list[str]]]:
    """Read a file. Yields the number (from 1) and the words of each line that is not empty.

    Raises InputError for a file that is too large for a clip with so many frames.
    """
    most = min(MAX_TEXT_BYTES, LONGEST_LINE * (time.frames + 10))
    for number, line in enumerate(read_text(path, most).splitlines(), 1):
        if words := line.split():
            yield number, words


def _parse_number(path: Path, line: int, word: str) -> float:
    """The number that a word stands for. Raises InputError if it is none, or is not finite."""
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(path, f"{word!r} is not a number", line=line)
    return value


def _read_matrix(path: Path, time: SourceTime, columns: int) -> Array:
    """(rows, columns) numbers in 0..1 from a file with a row for each source frame.

    The file may have one row more or less than the source has frames.
    """
    rows = []
    for number, words in _read_lines(path, time):
        if len(words) != columns:
            raise InputError(path, f"has {len(words)} values instead of {columns}", line=number)
        values = [_parse_number(path, number, w) for w in words]
        if not all(-1e-6 <= v <= 1 + 1e-6 for v in values):
            raise InputError(path, "has a value outside 0..1", line=number)
        rows.append(values)
        if len(rows) > time.frames + 1:
            break
    if abs(len(rows) - time.frames) > 1:
        fix = "Write one row for each frame, or remove the file to label the clip automatically."
        problem = f"has {len(rows)} rows, but the clip's file has {time.frames} frames"
        raise InputError(path, problem, fix=fix)
    return np.array(rows, float)


# Writes automatic labels as files that people can correct: `_footsteps.txt`, `_gait.txt`. The phase follows
# from the footsteps.


HALF_FADE = 15  # frames at 60 Hz; a fade begins this long before a change of gait and ends this long after it


def footsteps_text(labels: Labels, time: SourceTime) -> str:
    """The content of `_footsteps.txt`: lines `right left`, the frames in which the right and left foot land.

    Rows of `labels.footsteps` that lack a landing are left out, except a last row that lacks only the left
    one. A `*` at the end of a line says that no cycle uses the frames from this line's right landing to the
    next line's. It is written for rows that are marked in the labels. It is also written before a row that is
    left out, because the next line then begins another bout of walking and the file has no other way to say
    so. If a bout ends with a landing of the right foot, its last cycle is lost.
    """
    lines = []
    rows = labels.footsteps
    written = np.isfinite(rows[:, 0]) & (np.isfinite(rows[:, 1]) | (np.arange(len(rows)) == len(rows) - 1))
    for number in np.flatnonzero(written):
        right, left, dropped = rows[number]
        landings = [str(_source_frame(x, time)) for x in (right, left) if np.isfinite(x)]
        next_is_left_out = not written[number + 1 : number + 2].all()
        marked = (dropped or next_is_left_out) and len(landings) == 2
        lines.append(" ".join([*landings, *(["*"] if marked else [])]))
    return "".join(f"{line}\n" for line in lines)


def gait_text(labels: Labels, time: SourceTime) -> str:
    """The content of `_gait.txt`: lines `frame gait`, for the first frame and for each change of gait.

    A change has two lines: one with the old gait where the fade to the new gait begins, and one with the new
    gait where the fade ends.
    """
    gaits = labels.gait.argmax(axis=1).tolist()
    changes = [i for i in range(1, len(gaits)) if gaits[i] != gaits[i - 1]]
    keys: list[tuple[int, int]] = [(0, gaits[0])]  # (frame of the clip, index of the gait in GAITS)
    for change, next_change in itertools.pairwise([*changes, len(gaits)]):
        # A fade begins after the fade before it, and ends by the middle between this change and the next.
        first = max(change - HALF_FADE, keys[-1][0] + 1)
        last = max(min(change + HALF_FADE, (change + next_change) // 2), first + 1)
        keys += [(first, gaits[change - 1]), (last, gaits[change])]
    frames = [_source_frame(frame, time) for frame, _ in keys]
    # At a low frame rate several keys may fall on the same source frame. Only the first of them is written.
    kept = [0, *(i + 1 for i, (a, b) in enumerate(itertools.pairwise(frames)) if b > a)]
    return "".join(f"{frames[i]} {GAITS[keys[i][1]]}\n" for i in kept)


def _source_frame(frame: float, time: SourceTime) -> int:
    """The source frame, counted from 1, nearest to a frame of the clip, which may lie between two frames."""
    return min(max(round(frame * time.ratio + time.first) + 1, 1), time.frames)
