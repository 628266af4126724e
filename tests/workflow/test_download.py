"""Clips that are not in the user's folder, through the workflow, from a server on the loopback address."""

import hashlib
import json
from pathlib import Path

import pytest

pytestmark = [pytest.mark.workflow, pytest.mark.slow]

TARGET = "results/datasets/far/motion/walk.json"
DATASET = """
skeleton: holden31
folder: far
download: {url: '%s', checksums: far.sha256}
clips: {walk: }
"""


def test_a_clip_that_the_folder_lacks_is_downloaded_once(workflow, clips, server) -> None:
    server.content = Path(clips[1]).read_bytes()
    sha256 = hashlib.sha256(server.content).hexdigest()
    config = workflow.folder / "config/datasets"
    (config / "far.yaml").write_text(DATASET % server.url.replace("walk", "{subject}/{clip}"))
    (config / "far.sha256").write_text(f"{'0' * 64}  walk.bvh\n")
    kept = workflow.folder / "data/downloaded/far/walk.bvh"

    assert workflow.planned(TARGET) == {"download_clip": 1, "motion_clips": 1, "clip_file": 1}
    assert server.requests == 0
    text = workflow.run("-c1", TARGET, ok=False)
    assert f"cannot be downloaded: the server has another file: its SHA-256 is {sha256}" in text
    assert "data/far yourself" in text
    assert "Traceback" not in text
    assert list(kept.parent.glob("*")) == []

    (config / "far.sha256").write_text(f"{sha256}  walk.bvh\n")
    server.requests = 0
    server.faults = [503, len(server.content) // 3]
    workflow.run("-c1", TARGET)
    assert kept.read_bytes() == server.content
    assert server.requests == 3
    assert json.loads((workflow.folder / TARGET).read_text())["sha256"] == sha256
    assert workflow.planned(TARGET) == {}
