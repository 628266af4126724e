"""Finds out how a result was made: with which versions and commit, and on which machine."""

from __future__ import annotations

import json
import os
import platform
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any

from hobble.core.processors import processor_name
from hobble.evaluation.pipeline_results import Machine

WEB = Path(__file__).parent / "web"  # the page's scripts
# The Python packages whose versions are reported.
PACKAGES = ("hobble", "torch", "numpy", "scipy", "numba", "snakemake", "pydantic", "jinja2")


def versions() -> dict[str, str]:
    """Name -> version, for Python, the main Python packages and the page's npm packages."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found | json.loads((WEB / "package.json").read_text(encoding="utf-8"))["dependencies"]


def machine() -> Machine:
    """System, processor, cores and memory of this machine, but not the name of the host or the user."""
    return {
        "system": f"{platform.system()} {platform.machine()}",
        "processor": processor_name(),
        "cores": os.cpu_count(),
        "memory_gb": _memory_gb(),
    }


def git_commit(folder: Path) -> dict[str, Any] | None:
    """The hash of the commit that is checked out at `folder`, and whether tracked files differ from it.

    None if `folder` is not in a git checkout, or if git is not installed.
    """
    try:
        head = _git(folder, "rev-parse", "HEAD")
        return {
            "commit": head,
            "changed": bool(_git(folder, "status", "--porcelain", "--untracked-files=no")),
        }
    except (OSError, subprocess.SubprocessError):
        return None


def _git(folder: Path, *arguments: str) -> str:
    """The output of a git command in `folder`."""
    command = ["git", "-C", str(folder), "--no-optional-locks", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10)
    return done.stdout.strip()


def _memory_gb() -> float | None:
    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9, 1)
    except (ValueError, OSError, AttributeError):
        return None
