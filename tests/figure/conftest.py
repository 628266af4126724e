"""The page's npm packages, for tests that open our files with other programs."""

from __future__ import annotations

import fcntl
import hashlib
from pathlib import Path

import pytest

from hobble.core.errors import HobbleError
from hobble.report.bundle import WEB, install_npm_packages


@pytest.fixture(scope="session")
def page_modules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the packages, fetched once for all workers; skips if they cannot be fetched."""
    lock = (WEB / "package-lock.json").read_bytes()
    shared = tmp_path_factory.getbasetemp().parent / f"page-{hashlib.sha256(lock).hexdigest()[:12]}"
    shared.mkdir(exist_ok=True)
    with open(shared / "lock", "w") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        if not (shared / "done").exists():
            try:
                install_npm_packages(shared)
            except HobbleError as error:
                pytest.skip(str(error))
            (shared / "done").touch()
    return shared / "node_modules"
