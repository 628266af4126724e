"""The files of clips in a user's folder: which are found, left out or refused."""

import os
from pathlib import Path

import pytest

from hobble.core.errors import HobbleError
from hobble.motion import ClipMotion
from hobble.motion.make import load_source
from hobble.motion.read import read_bvh
from hobble.motion.skeleton_file import load_skeleton
from hobble.workflow.project import Project
from tests.workflow.conftest import DATASET


def test_clips_are_found_once_in_sub_and_linked_folders_whatever_the_case_of_their_suffix(base: Path) -> None:
    """A linked collection is found once, even if one of its links leads back to it."""
    kept = base / "kept/day 1"
    kept.mkdir(parents=True)
    (kept / "d.BVH").write_text("")
    (kept / "d_gait.txt").write_text("1 walk\n")
    (kept / "d_injuries.txt").write_text("frames:9\n")
    (kept / "back").symlink_to(base / "data/mine")
    for name in ("first", "second"):
        (base / f"data/mine/{name}").symlink_to(base / "kept")
    (base / "data/mine/gone").symlink_to(base / "nowhere")
    (base / "data/mine/.trash").mkdir()
    (base / "data/mine/.trash/e.bvh").write_text("")
    data, found = Project(base, {}).dataset("mine"), base / "data/mine/first/day 1"
    assert list(data.entries) == ["a", "b", "c", "d"]
    assert data.source("d") == str(found / "d.BVH")
    assert data.label_files("d") == [str(found / "d_gait.txt")]
    assert data.channel_files("d", "injury") == [str(found / "d_injuries.txt")]


@pytest.mark.parametrize("mirror", [True, False])
def test_a_mirror_beside_its_original_is_left_out(base: Path, mirror: bool) -> None:
    text = DATASET.replace("mirror: true", f"mirror: {str(mirror).lower()}")
    (base / "config/datasets/mine.yaml").write_text(text)
    (base / "data/mine/a_mirror_footsteps.txt").write_text("1 2\n")
    clips = Project(base, {}).dataset("mine")
    assert list(clips.entries) == ["a", "b", "c"]
    notes = clips.notes_on_unused_files()
    assert ["are mirrors of other clips (a_mirror" in note for note in notes] == [True] * (not mirror)


def test_a_status_file_without_a_clip_is_reported_with_the_nearest_name(base: Path) -> None:
    (base / "data/mine/orphan.bvh").write_text("")
    (base / "data/mine/orphn_injuries.txt").write_text("frames:9\n1-9 LeftLeg-LeftFoot[4];\n")
    (note,) = Project(base, {}).dataset("mine").notes_on_unused_files()
    assert "orphn_injuries.txt belongs to no clip and is not read. If it belongs to orphan, rename" in note


def test_two_files_of_one_clip_are_refused_with_both(base: Path) -> None:
    (base / "data/mine/old").mkdir()
    (base / "data/mine/old/a.BVH").write_text("")
    with pytest.raises(HobbleError, match=r"old/a\.BVH: a second file of clip a; the first is .*mine/a\.bvh"):
        _ = Project(base, {}).dataset("mine").entries


@pytest.mark.parametrize("name", ["a.bvh", "map.txt"])
def test_a_pipe_is_refused_as_a_clip(base: Path, name: str) -> None:
    """A pipe is refused during planning, because Snakemake would wait for its end."""
    text = DATASET + "terrain: {heightmaps: [{kind: file, path: mine/map.txt}]}\n"
    (base / "config/datasets/mine.yaml").write_text(text)
    (base / f"data/mine/{name}").unlink(missing_ok=True)
    os.mkfifo(base / f"data/mine/{name}")
    with pytest.raises(HobbleError, match=f"mine/{name}: a device or a pipe, not a file"):
        getattr(Project(base, {}).dataset("mine"), "entries" if name == "a.bvh" else "heightmap_files")


@pytest.mark.shared
def test_plan_and_job_use_the_same_skeleton_file(root: Path, shared: Path) -> None:
    project = Project(root, {"mocap": str(shared / "mocap")})
    target = load_skeleton(root / "config/skeletons/holden31.yaml")
    options = ClipMotion()
    for clip in ("Injured_Ilde", "Injured_Walk_LLL", "Injured_Run_LLL_extended_converted"):
        file = read_bvh(project.dataset("ferre").source(clip))
        rig = load_source(file, target, root / "config/skeletons", options).match.rig
        files = project.dataset("ferre").clip_skeleton_files(clip)
        assert [Path(f).stem for f in files] == [rig] * (rig != "holden31")


def test_a_data_set_may_have_generated_clips_beside_captured_ones(base: Path) -> None:
    mine = base / "config/datasets/mine.yaml"
    entries = "clips: {b: , low: {recipe: crouch, share: .3}}\n"
    mine.write_text(f"{DATASET}{entries}synthetic: {{frames: 600}}\n")
    clips = Project(base, {}).dataset("mine")
    assert [clips.source(clip)[-8:] for clip in clips.listed] == ["ne/b.bvh", "/low.bvh"]
    assert (clips.frames("low"), len(clips.label_files("low"))) == (600, 2)
    mine.write_text(DATASET + entries)
    with pytest.raises(HobbleError, match=r"clips.low has a `recipe`, but the data set no .* `synthetic`"):
        Project(base, {}).dataset("mine")
