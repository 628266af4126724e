"""The origin of a result: versions, commit, machine."""

from __future__ import annotations

import json
import os
import platform
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any

from hobble.core.processors import processor
from hobble.evaluation.pipeline_results import Machine

WEB = Path(__file__).parent / "web"
PACKAGES = ("hobble", "torch", "numpy", "scipy", "numba", "snakemake", "pydantic", "jinja2")


def versions() -> dict[str, str]:
    """Versions of Python, of the main Python packages, and of the page's npm packages."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found | json.loads((WEB / "package.json").read_text(encoding="utf-8"))["dependencies"]


def machine() -> Machine:
    """System, processor, cores and memory of this machine. No host or user name."""
    return {
        "system": f"{platform.system()} {platform.machine()}",
        "processor": processor(),
        "cores": os.cpu_count(),
        "memory_gb": _memory_gb(),
    }


def commit(folder: Path) -> dict[str, Any] | None:
    """The commit of the checkout at `folder`, and whether it has uncommitted changes; None without git."""
    try:
        head = _git(folder, "rev-parse", "HEAD")
        return {
            "commit": head,
            "changed": bool(_git(folder, "status", "--porcelain", "--untracked-files=no")),
        }
    except (OSError, subprocess.SubprocessError):
        return None


def _git(folder: Path, *arguments: str) -> str:
    command = ["git", "-C", str(folder), "--no-optional-locks", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10)
    return done.stdout.strip()


def _memory_gb() -> float | None:
    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9, 1)
    except (ValueError, OSError, AttributeError):
        return None
