"""A short trial of several ways to compute the same thing, and a file that stores which one was the fastest.

The results of the ways differ in their last bits. So the first choice is used in every later run on the same
kind of machine. The file is in the user's cache folder, one for each kind of processor, version of PyTorch
and setting of the libraries. If there is no such folder, or it cannot be written, a default is used without a
trial.
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
from hobble.core.processors import processor

# Environment variables that limit which instructions the libraries use, and so change speed and rounding.
SETTINGS = ("ATEN_CPU_CAPABILITY", "ONEDNN_MAX_CPU_ISA", "MKL_ENABLE_INSTRUCTIONS", "MKL_CBWR")
SECONDS = 0.1  # length of a trial of one product
CALLS_OF_A_WAY = 5, 50  # fewest and most calls of each way in a trial
GIVE_UP_ABOVE = 1.5  # a way this many times slower than another after two turns gets no more turns
REPLACES_BELOW = 0.97  # a way replaces one listed before it only if it takes less than this share of its time

log = logging.getLogger("hobble")


def kept_choice(name: str, trial: Callable[[], str], ways: Collection[str], without: str) -> str:
    """The way that the file names for the product `name`. If it names none, run `trial` and store its choice.

    ways: the allowed names. without: the way to take if the choice cannot be stored. Processes that ask at
    the same time wait for the trial of the first one.
    """
    try:
        path = choices_file()
        found = _read(path).get(name)
        if isinstance(found, str) and found in ways:
            return found
        with _locked(path.with_suffix(".lock")):
            choices = _read(path)
            found = choices.get(name)
            if not isinstance(found, str) or found not in ways:
                found = trial()
                write_json(path, {"machine": machine(), "ways": {**choices, name: found}})
            return found
    except (HobbleError, OSError, RuntimeError) as error:
        _warn_once(str(error))
        return without


def fastest(ways: Mapping[str, Callable[[], object]], clock: Callable[[], float] = perf_counter) -> str:
    """The name of the way with the shortest call. The ways take turns, because other programs come and go.

    clock: returns seconds. With one thread, use the time of that thread: other work does not add to it.
    """
    best = dict.fromkeys(ways, float("inf"))
    begun = perf_counter()
    for turn in range(CALLS_OF_A_WAY[1]):
        if turn >= CALLS_OF_A_WAY[0] and perf_counter() - begun > SECONDS:
            break
        least = min(best.values())
        for name, call in ways.items():
            if turn < 2 or best[name] < GIVE_UP_ABOVE * least:
                before = clock()
                call()
                best[name] = min(best[name], clock() - before)
    chosen, *others = ways
    for name in others:
        if best[name] < REPLACES_BELOW * best[chosen]:
            chosen = name
    return chosen


def machine() -> dict[str, str]:
    """The facts about the machine on which a choice depends."""
    settings = {name: os.environ[name] for name in SETTINGS if name in os.environ}
    return {"processor": processor(), "torch": str(torch.__version__), **settings}


def choices_file() -> Path:
    """The file of this kind of machine. Raises RuntimeError if the user has no home."""
    folder = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    digest = hashlib.sha256(json.dumps(machine(), sort_keys=True).encode()).hexdigest()[:12]
    return Path(folder) / "hobble" / f"products-{digest}.json"


def _read(path: Path) -> dict[str, Any]:
    """The choices in the file; none if it is missing or damaged, so that they are made again."""
    try:
        ways = read_json(path)["ways"]
        return ways if isinstance(ways, dict) else {}
    except (HobbleError, OSError, KeyError, TypeError):
        return {}


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "a", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # until the file is closed
        yield


@cache
def _warn_once(problem: str) -> None:
    log.warning("the fastest way to multiply matrices cannot be saved; the default is used (%s)", problem)
