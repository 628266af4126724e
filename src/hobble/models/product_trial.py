"""A short trial of several ways to compute the same thing, and a file that stores which one was the fastest.

A "way" is a function that computes the result, or a number of threads. The ways round differently, so their
results differ in the last bits. So that results do not change from run to run, the way chosen in the first
trial is used in every later run on the same kind of machine. The file is in the user's cache folder. It has
its own name for each combination of processor, version of PyTorch and settings of the libraries. If it cannot
be written, a default is used without a trial.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import logging
import os
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import Any

import torch

from hobble.core.errors import HobbleError
from hobble.core.files import read_json, write_json
from hobble.core.processors import processor_name

# Environment variables that limit which processor instructions the libraries use. They change speed and
# rounding.
SETTINGS = ("ATEN_CPU_CAPABILITY", "ONEDNN_MAX_CPU_ISA", "MKL_ENABLE_INSTRUCTIONS", "MKL_CBWR")
# In each turn of a trial, each way is called once. A trial ends after MOST_TURNS turns, or as soon as it has
# had LEAST_TURNS turns and has taken TRIAL_SECONDS.
LEAST_TURNS, MOST_TURNS = 5, 50
TRIAL_SECONDS = 0.1
GIVE_UP_ABOVE = 1.5  # after two turns, a way this many times slower than the fastest is not called again
# The first way is chosen unless a later way is clearly faster. A later way has to take less than this share
# of the time of the way chosen so far.
REPLACES_BELOW = 0.97

log = logging.getLogger("hobble")


def choose_once(name: str, trial: Callable[[], str], ways: Collection[str], default: str) -> str:
    """The way that the file stores under `name`. If the file stores none, run `trial` and store its choice.

    name: what is computed, such as the shape of a matrix product. trial: returns the name of a way. ways: the
    allowed names of ways. default: the way to take if the choice cannot be stored. If several processes call
    this function at the same time, one of them runs the trial and the others wait for its choice.
    """
    try:
        path = choices_file()
        way = _read(path).get(name)
        if isinstance(way, str) and way in ways:
            return way
        with _locked(path.with_suffix(".lock")):
            choices = _read(path)
            way = choices.get(name)
            if not isinstance(way, str) or way not in ways:
                way = trial()
                write_json(path, {"machine": machine(), "ways": {**choices, name: way}})
            return way
    except (HobbleError, OSError, RuntimeError) as error:
        _warn_once(str(error))
        return default


def fastest_way(ways: Mapping[str, Callable[[], object]], clock: Callable[[], float] = perf_counter) -> str:
    """The name of the way whose shortest call is the shortest. Of nearly equal ways, it is the first one.

    ways: name -> function to call. They are called in turn, so that the work of other programs slows down all
    of them alike. clock: returns seconds. For ways that use one thread, pass a clock of this thread's
    processor time, because the work of other programs does not add to it.
    """
    best = dict.fromkeys(ways, float("inf"))  # seconds of the shortest call
    start = perf_counter()
    for turn in range(MOST_TURNS):
        if turn >= LEAST_TURNS and perf_counter() - start > TRIAL_SECONDS:
            break
        shortest = min(best.values())
        for name, call in ways.items():
            if turn < 2 or best[name] < GIVE_UP_ABOVE * shortest:
                before = clock()
                call()
                best[name] = min(best[name], clock() - before)
    chosen, *others = ways
    for name in others:
        if best[name] < REPLACES_BELOW * best[chosen]:
            chosen = name
    return chosen


def machine() -> dict[str, str]:
    """What a choice depends on: the processor, the version of PyTorch, and those of SETTINGS that are set."""
    settings = {name: os.environ[name] for name in SETTINGS if name in os.environ}
    return {"processor": processor_name(), "torch": str(torch.__version__), **settings}


def choices_file() -> Path:
    """The path of the file for this kind of machine. Raises RuntimeError if the user has no home."""
    folder = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    digest = hashlib.sha256(json.dumps(machine(), sort_keys=True).encode()).hexdigest()[:12]
    return Path(folder) / "hobble" / f"products-{digest}.json"


def _read(path: Path) -> dict[str, Any]:
    """The choices in the file, name of what is computed -> name of the way.

    Empty if the file is missing or damaged, so that new trials are run.
    """
    try:
        ways = read_json(path)["ways"]
        return ways if isinstance(ways, dict) else {}
    except (HobbleError, OSError, KeyError, TypeError):
        return {}


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold the lock file `path` during the block. Other processes wait until then."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "a", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # closing the file releases the lock
        yield


@cache
def _warn_once(problem: str) -> None:
    log.warning(
        "the fastest way to multiply matrices cannot be saved, so the default way is used, which may be "
        "slower (%s)",
        problem,
    )
