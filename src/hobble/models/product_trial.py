"""A short trial of several ways to compute the same thing, and a file that stores which one was the fastest.

The results of the ways differ in their last bits. So that results do not change, the way chosen in the first
trial is used in every later run on the same kind of machine. The user's cache folder has one such file for
each kind of processor, version of PyTorch and setting of the libraries. If the folder is missing or cannot be
written to, a default is used without a trial.
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
# A trial calls each way once in each turn. It has at least LEAST_TURNS and at most MOST_TURNS turns, and
# between these numbers it ends as soon as TRIAL_SECONDS are over.
LEAST_TURNS, MOST_TURNS = 5, 50
TRIAL_SECONDS = 0.1
GIVE_UP_ABOVE = 1.5  # after two turns, a way this many times slower than the fastest is not called again
# The ways are compared in their order: a later way replaces the one chosen so far only if it takes less than
# this share of that one's time.
REPLACES_BELOW = 0.97

log = logging.getLogger("hobble")


def kept_choice(name: str, trial: Callable[[], str], ways: Collection[str], default: str) -> str:
    """The way that the file stores under `name`. If there is none, run `trial` and store its choice.

    name: what is computed, such as a product and its shape. trial: returns the name of a way. ways: the
    allowed names of ways. default: the way to take if the choice cannot be stored. If several processes ask
    at the same time, one of them runs the trial and the others wait for its choice.
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


def fastest(ways: Mapping[str, Callable[[], object]], clock: Callable[[], float] = perf_counter) -> str:
    """The name of the way with the shortest call.

    ways: name -> function to call. They take turns, so that the work of other programs slows down all of them
    alike. clock: returns seconds. For ways that use one thread, give the processor time of that thread: the
    work of other programs does not add to it.
    """
    best = dict.fromkeys(ways, float("inf"))
    begun = perf_counter()
    for turn in range(MOST_TURNS):
        if turn >= LEAST_TURNS and perf_counter() - begun > TRIAL_SECONDS:
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
    """The path of the file for this kind of machine. Raises RuntimeError if the user has no home."""
    folder = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    digest = hashlib.sha256(json.dumps(machine(), sort_keys=True).encode()).hexdigest()[:12]
    return Path(folder) / "hobble" / f"products-{digest}.json"


def _read(path: Path) -> dict[str, Any]:
    """The choices in the file; none if it is missing or damaged, so that new trials are run."""
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
