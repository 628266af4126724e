"""The page's npm packages, for tests that open our files with other programs."""

from pathlib import Path

import pytest

from tests.checkout import Workflow


@pytest.fixture(scope="session")
def page_modules(finished: Workflow) -> Path:
    """The folder of the packages that the shared run of the workflow has."""
    return finished.folder / "results/page/node_modules"
