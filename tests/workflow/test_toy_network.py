"""A new kind of network needs only a folder. The whole workflow runs with a linear network."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from .conftest import Workflow

TOY = Path(__file__).parent / "toy_network"


@pytest.mark.workflow
@pytest.mark.slow
def test_a_linear_network_goes_from_training_to_the_page(copied: Workflow) -> None:
    shutil.copytree(TOY, copied.own_source() / "models" / "toy")
    (copied.folder / "config" / "toy.yaml").write_text("extends: test\nnetwork:\n  kind: toy\n")
    # No existing network, row or measurement is made again because of it.
    assert set(copied.planned("results/test/report.html")) <= {"page_bundle", "report"}
    copied.run("-c2", "results/toy/report.html")
    results = copied.folder / "results" / "toy"
    accuracy = json.loads((results / "evaluation" / "accuracy.json").read_text())
    assert 0 < accuracy["train"]["mean"] < 1
    page = (results / "report.html").read_text(encoding="utf-8")
    assert "A toy that is linear, with 372 inputs and 311 outputs, trained for 2 passes" in page
    assert '"file":"SE9CQkxF' in page.replace(": ", ":"), "HOBBLE, the beginning of a character file"
