"""Data sets that are downloaded: addresses, checksums, and a run with a server on the loopback address."""

import hashlib
import json
from pathlib import Path

import pytest

from hobble.core.errors import HobbleError
from hobble.workflow.project import Project

FAR = """
skeleton: s
folder: far
download: {url: 'https://host/{subject:0>3}/{clip}.bvh', checksums: far.sha256}
"""


def test_missing_clips_are_downloaded(base: Path) -> None:
    (base / "config/datasets/far.yaml").write_text(FAR + "clips: {'2_1': , '2_2': , '2_3': }\n")
    (base / "config/datasets/far.sha256").write_text(f"{'a' * 64}  2_1.bvh\n{'B' * 64} *2_2.bvh\n\n")
    project = Project(base, {})
    assert project.dataset("far").source("2_1") == str(base / "data/downloaded/far/2_1.bvh")
    assert project.dataset("far").download("2_2") == {
        "url": "https://host/002/2_2.bvh",
        "sha256": "b" * 64,
        "folder": str(base / "data/far"),
    }
    with pytest.raises(HobbleError, match=r"far/2_3\.bvh: no such file, .*not in the download list"):
        project.dataset("far").source("2_3")
    (base / "data/far").mkdir()
    (base / "data/far/2_1.bvh").write_text("")
    assert Project(base, {}).dataset("far").source("2_1") == str(base / "data/far/2_1.bvh")


BAD = (
    ("https://host/", "ftp://host/", r"download: url: must be an address like"),
    ("{clip}", "{name}", r"download: url: must contain \{clip\}; only"),
    ("{clip}", "{clip:a>400000000}", "padding to a width of up to 99"),
    ("clips: {'2_1': }\n", "", "needs a list of its `clips` and a `folder`"),
)


def test_a_bad_address_or_checksum_is_reported(base: Path) -> None:
    file = base / "config/datasets/far.yaml"
    for old, new, message in BAD:
        file.write_text((FAR + "clips: {'2_1': }\n").replace(old, new))
        with pytest.raises(HobbleError, match=message):
            Project(base, {}).catalogue.dataset("far")
    file.write_text(FAR + "clips: {'2_1': }\n")
    file.with_suffix(".sha256").write_text(f"{'a' * 64}  2_1.bvh\n{'a' * 63}  2_2.bvh\n")
    with pytest.raises(HobbleError, match=r"far\.sha256, line 2: expected a SHA-256"):
        Project(base, {}).dataset("far").source("2_1")


def test_every_clip_of_the_cmu_set_has_a_checksum_and_an_address(root: Path) -> None:
    cmu = Project(root, {"mocap": "nowhere"}).dataset("cmu")
    assert sum(not cmu.is_generated(clip) for clip in cmu.listed) == 68
    assert cmu.download("02_01")["url"].endswith("/cmu-mocap/master/data/002/02_01.bvh")


@pytest.mark.shared
def test_the_checksums_are_those_of_the_files(root: Path, shared: Path) -> None:
    cmu = Project(root, {}).dataset("cmu")
    for clip in (name for name in cmu.listed if not cmu.is_generated(name)):
        data = (shared / f"mocap/cmu/{clip}.bvh").read_bytes()
        assert cmu.download(clip)["sha256"] == hashlib.sha256(data).hexdigest()


TARGET = "results/datasets/far/motion/walk.json"
SERVED = """
skeleton: holden31
folder: far
download: {url: '%s', checksums: far.sha256}
clips: {walk: }
"""


@pytest.mark.workflow
@pytest.mark.slow
def test_a_clip_that_the_folder_lacks_is_downloaded_once(workflow, clips, server) -> None:
    server.content = Path(clips[1]).read_bytes()
    sha256 = hashlib.sha256(server.content).hexdigest()
    config = workflow.folder / "config/datasets"
    (config / "far.yaml").write_text(SERVED % server.url.replace("walk", "{subject}/{clip}"))
    (config / "far.sha256").write_text(f"{'0' * 64}  walk.bvh\n")
    kept = workflow.folder / "data/downloaded/far/walk.bvh"

    assert workflow.planned(TARGET) == {"download_clip": 1, "motion_clips": 1, "clip_file": 1}
    assert server.requests == 0
    text = workflow.run("-c1", TARGET, ok=False)
    assert f"cannot be downloaded: the server has another file: its SHA-256 is {sha256}" in text
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
