"""Attacks that are existing tests, each with one file, server or call. They are run and counted."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from .judging import FAULT, REFUSED, SKIPPED, UNHARMED, Throw
from .lab import ROOT

# What is thrown -> where it hits, what should happen, and the tests that throw it.
ATTACKS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "a hostile network": (
        "its reader",
        REFUSED,
        (
            "tests/models/test_load.py::test_a_malformed_network_is_refused",
            "tests/models/test_load.py::test_a_malformed_folder_of_bins_is_refused",
            "tests/models/test_load.py::test_what_is_not_a_regular_file_is_refused",
            "tests/models/test_load.py::test_entries_that_overlap_take_no_memory",
            "tests/models/test_kinds.py::test_a_malformed_array_is_refused",
        ),
    ),
    "a bad download server": ("a clip's download", UNHARMED, ("tests/motion/test_download.py",)),
    "a hostile file or name": (
        "its reader",
        REFUSED,
        (
            "tests/faults/test_hostile_bvh.py",
            "tests/faults/test_hostile_arrays.py",
            "tests/faults/test_hostile_names.py",
            "tests/faults/test_no_code_runs.py",
        ),
    ),
    "clips with awkward names": ("a whole run", UNHARMED, ("tests/faults/test_names.py",)),
    "a misuse of the runtime": (
        "`next_pose`",
        REFUSED,
        (
            "tests/runtime/test_wrong_calls.py::test_impossible_targets_are_refused_and_change_nothing",
            "tests/runtime/test_wrong_calls.py::test_invalid_targets_are_refused",
            "tests/runtime/test_wrong_calls.py::test_severities_of_another_shape_are_refused",
            "tests/runtime/test_wrong_calls.py::test_a_severity_out_of_range_is_refused",
            "tests/runtime/test_wrong_calls.py::test_a_terrain_that_raises_leaves_the_state_as_it_was",
        ),
    ),
    "a character whose state is not finite": (
        "a character",
        UNHARMED,
        ("tests/runtime/test_bounds.py::test_a_state_that_is_not_finite_restarts_and_warns_once",),
    ),
    "a cache of compiled code that cannot be written": (
        "an import",
        UNHARMED,
        ("tests/core/test_compiled.py",),
    ),
    "a signal or a lock": (
        "a whole run",
        UNHARMED,
        ("tests/workflow/test_stops.py", "tests/workflow/test_lifetime.py"),
    ),
}


def thrown(scratch: Path) -> list[Throw]:
    """Run every attack. A test that passes is an attack that ended as it should."""
    return [throw for what in ATTACKS for throw in _one(what, scratch)]


def _one(what: str, scratch: Path) -> Iterator[Throw]:
    at, should, tests = ATTACKS[what]
    said = scratch / "attacks.xml"
    said.unlink(missing_ok=True)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", f"--junitxml={said}", *tests]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    cases = list(ElementTree.parse(said).iter("testcase")) if said.exists() else []
    if not cases:
        yield Throw(what, at, FAULT, f"no test ran: {done.stdout[-1500:]}{done.stderr[-1500:]}")
    for case in cases:
        outcomes = {child.tag: child for child in case}
        failed = outcomes.get("failure", outcomes.get("error"))
        if failed is not None:
            detail = f"{case.get('name')}: {failed.get('message')}"
            print(f"{what}, {at}: {FAULT} {detail}", flush=True)
            yield Throw(what, at, FAULT, detail)
        else:
            yield Throw(what, at, SKIPPED if "skipped" in outcomes else should)
