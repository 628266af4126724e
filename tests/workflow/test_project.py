"""Which clips a configuration gets, in which split, and from which files."""

from __future__ import annotations

import json
import os
import re
import shutil
from pathlib import Path

import pytest

from hobble.channels import channel
from hobble.core.errors import HobbleError
from hobble.motion.options import ClipMotion
from hobble.workflow import targets
from hobble.workflow.project import Project
from hobble.workflow.targets import check, notes

DATASET = """
skeleton: s
folder: mine
mirror: true
held_out: [b]
"""


@pytest.fixture
def base(tmp_path: Path) -> Path:
    """A checkout with one configuration and a data set of three clips, one hurt by its status file."""
    (tmp_path / "config/datasets").mkdir(parents=True)
    (tmp_path / "config/one.yaml").write_text("dataset: mine\n")
    (tmp_path / "config/hurt.yaml").write_text("extends: one\nchannels: [injury]\n")
    (tmp_path / "config/datasets/mine.yaml").write_text(DATASET)
    folder = tmp_path / "data/mine"
    folder.mkdir(parents=True)
    for name in ("a", "b", "c", "a_mirror"):
        (folder / f"{name}.bvh").write_text("")
    (folder / "c_injuries.txt").write_text("frames:9\n1-9 LeftLeg-LeftFoot[4];\n")
    (folder / "a_injuries.txt").write_text("frames:9\n")
    (folder / "b_gait.txt").write_text("1 walk\n")
    return tmp_path


def test_mirrors_go_with_their_originals_and_hurt_clips_to_injured_networks(base: Path) -> None:
    project = Project(base, {})
    healthy = {"a": "train", "a_mirror": "train", "b": "held_out", "b_mirror": "held_out"}
    assert project.configurations.splits("one") == healthy
    assert project.configurations.splits("hurt") == {**healthy, "c": "train", "c_mirror": "train"}
    assert project.configurations.database("one").endswith("mine/database/plain")
    assert project.configurations.database("hurt").endswith("mine/database/injury")


MOODS = """
hurt: {versions: 1}
channels:
  mood: {patterns: {"b*": {sad: 1}}}
clips: {a: {person: ann}, b: , c: {person: ann}}
"""


def test_a_hurt_version_has_the_mood_of_its_clip(base: Path) -> None:
    (base / "config/datasets/mine.yaml").write_text(DATASET + MOODS)
    (base / "config/mood.yaml").write_text("extends: one\nchannels: [mood]\n")
    (base / "config/both.yaml").write_text("extends: one\nchannels: [mood, injury]\n")
    project = Project(base, {})
    values = project.datasets.channel_sources
    assert [values.neutral("mine", clip, "mood") for clip in ("a_hurt1", "b_hurt1")] == [True, False]
    source = channel("mood").source(values.source("mine", "b_hurt1", "mood"))
    assert not channel("mood").is_neutral(source)
    plain, moods = ("a", "a_mirror"), ("a", "a_mirror", "b", "b_mirror")
    both = {*moods, *(f"{v}{m}" for v in ("a_hurt1", "b_hurt1", "c") for m in ("", "_mirror"))}
    assert set(project.configurations.splits("one")) == set(plain)
    assert set(project.configurations.splits("mood")) == set(moods)
    assert set(project.configurations.splits("hurt")) == {c for c in both if c[0] != "b"}
    assert set(project.configurations.splits("both")) == both
    database = project.configurations.database("both")
    assert database.endswith("mine/database/injury+mood"), "in the order of the list of channels"
    people = project.measurements.people("both", "manners")
    assert {clip for clip, person in people.items() if person == "ann"} == {c for c in both if c[0] in "ac"}
    assert {person for clip, person in people.items() if clip[0] == "b"} == {"b"}
    assert project.measurements.people("both", "accuracy") == {}


def test_files_beside_a_clip_are_found_and_no_others(base: Path) -> None:
    project = Project(base, {})
    assert [Path(f).name for f in project.clips.label_files("mine", "b")] == ["b_gait.txt"]
    assert project.clips.label_files("mine", "c") == []
    assert [Path(f).name for f in project.datasets.channel_sources.files("mine", "c", "injury")] == [
        "c_injuries.txt"
    ]


def test_a_status_in_the_configuration_takes_the_place_of_the_file(base: Path) -> None:
    text = DATASET + "clips: {a: , b: , c: {channels: {injury: 'LeftArm-LeftForeArm[3]'}}}\n"
    (base / "config/datasets/mine.yaml").write_text(text)
    assert Project(base, {}).datasets.channel_sources.files("mine", "c", "injury") == []


def test_severities_of_0_hurt_nobody(base: Path) -> None:
    (base / "data/mine/a_injuries.txt").write_text(
        "frames:9\n1-9 LeftLeg-LeftFoot[0];LeftArm-LeftForeArm[0.0];\n"
    )
    (base / "data/mine/c_injuries.txt").write_text(
        "frames:9\n1-4 LeftLeg-LeftFoot[0];\n5-9 LeftLeg-LeftFoot[.5];\n"
    )
    assert [Project(base, {}).datasets.channel_sources.neutral("mine", clip, "injury") for clip in "abc"] == [
        True,
        True,
        False,
    ]
    text = (
        DATASET
        + "clips: {a: {channels: {injury: 'LeftLeg-LeftFoot[2]'}}, "
        + "b: {channels: {injury: 'LeftLeg-LeftFoot[0]'}}, c: }\n"
    )
    (base / "config/datasets/mine.yaml").write_text(text)
    assert [Project(base, {}).datasets.channel_sources.neutral("mine", clip, "injury") for clip in "abc"] == [
        False,
        True,
        False,
    ]


@pytest.mark.parametrize("name", ["Walk Forward", "walk, slow (2)", "gå+走"])
def test_a_clip_can_be_configured_whatever_its_file_is_called(base: Path, name: str) -> None:
    (base / f"data/mine/{name}.bvh").write_text("")
    text = f"{DATASET.replace('[b]', json.dumps([name]))}clips: {{a: , {json.dumps(name)}: {{gait: jog}}}}\n"
    (base / "config/datasets/mine.yaml").write_text(text)
    project = Project(base, {})
    assert project.clips.entry("mine", name).gait == "jog"
    assert project.configurations.splits("hurt")[name + "_mirror"] == "held_out"
    assert project.clips.source("mine", name) == str(base / f"data/mine/{name}.bvh")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (DATASET + "clips: {b: , a_mirror: }\n", "a_mirror: names that end in _mirror are reserved"),
        (DATASET.replace("[b]", "[z]"), "held_out names clips that do not exist: z"),
        (DATASET.replace("[b]", "[a, b, c]"), "no clip without injury is left to train on"),
        ("skeleton: s\nfolder: empty\n", "empty: no such folder"),
    ],
)
def test_a_data_set_that_cannot_work_is_reported(base: Path, text: str, message: str) -> None:
    (base / "config/datasets/mine.yaml").write_text(text)
    with pytest.raises(HobbleError, match=message):
        Project(base, {}).configurations.splits("one")


def test_where_all_clips_are_asked_for_no_clip_is_left(base: Path) -> None:
    (base / "config/datasets/mine.yaml").write_text(DATASET.replace("[b]", "[a, b, c]"))
    with pytest.raises(HobbleError, match="mine: no clip is left to train on"):
        Project(base, {}).configurations.splits("hurt")


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("results/one/stimuli", "configuration one has no `channels`"),
        ("results/eyes/stimuli/", "configuration one has no `channels`"),
        (
            "results/one/questionnaire/questionnaire.html",
            r"configuration one has no channel injury.*\[injury\]",
        ),
        ("results/hurt/export/cubik.onnx", "export/cubik.onnx: the phase modes are constant, linear, cubic"),
    ],
)
def test_impossible_targets_are_reported_before_training(
    base: Path, monkeypatch: pytest.MonkeyPatch, target: str, message: str
) -> None:
    (base / "config/eyes.yaml").write_text("extends: hurt\nnetwork_of: one\n")
    monkeypatch.setattr(targets, "_check_dataset", lambda *_: None)
    with pytest.raises(HobbleError, match=message):
        check(Project(base, {}), [target])
    fine = (
        "results/hurt/stimuli",
        "results/hurt/questionnaire/questionnaire.html",
        "results/one/export/pfnn",
        "results/one/export/cubic.onnx",
    )
    check(Project(base, {}), fine)


def test_a_listed_clip_without_its_file_is_told(base: Path) -> None:
    (base / "config/datasets/mine.yaml").write_text(DATASET + "clips: {a: , b: , gone: }\n")
    with pytest.raises(HobbleError, match=r"gone\.bvh: no such file"):
        Project(base, {}).clips.source("mine", "gone")


def test_the_walkers_frames_are_shared_out(root: Path) -> None:
    project = Project(root, {})
    total = sum(project.datasets.frames("synthetic", clip) for clip in project.clips.listed("synthetic"))
    assert abs(total - 11_412) < 20


def test_network_of_reads_the_other_configurations_files(root: Path) -> None:
    project = Project(root, {})
    assert project.configurations.network("ava-m", "weights.npz") == "results/ava/network/weights.npz"
    assert project.configurations.start("holden-xt") == ["results/holden/network/checkpoint.npz"]
    assert project.configurations.start("holden") == []


@pytest.fixture
def complete(base: Path, root: Path) -> Path:
    """The same, with the skeleton that the data set names."""
    (base / "config/skeletons").mkdir()
    shutil.copy(root / "config/skeletons/holden31.yaml", base / "config/skeletons/s.yaml")
    return base


LISTED = "skeleton: s\nfolder: mine\nclips: {a: , b: {%s}}\n"
WALKER = "skeleton: s\nsynthetic: {frames: 600}\nclips: {b: {%s}}\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            LISTED % "channels: {injury: 'LeftLeg-LeftFoot[11]'}",
            "clips.b.channels.injury: severity 11 of LeftLeg-LeftFoot is not in 0",
        ),
        (
            LISTED % "channels: {injury: 'LeftLeg-NoSuch[4]'}",
            "no such link: LeftLeg-NoSuch. Did you mean LeftLeg-LeftFoot",
        ),
        (LISTED % "channels: {injury: 'left knee 8'}", "'left knee 8' does not read as Joint-Joint"),
        (LISTED % "channels: {injury: ''}", "clips.b.channels.injury: names no link"),
        (WALKER % "recipe: wlak", "clips.b.recipe: no such recipe: wlak. There are walk-straight, walk, "),
    ],
)
def test_wrong_names_in_clip_entries_are_reported_before_anything_runs(
    complete: Path, text: str, message: str
) -> None:
    (complete / "config/datasets/mine.yaml").write_text(text)
    with pytest.raises(HobbleError, match=f"data set mine: .*{message}"):
        check(Project(complete, {}), ["results/one/report.html"])


def test_one_file_on_both_sides_of_the_split_is_refused_before_anything_runs(complete: Path) -> None:
    for name, text in (("a", "one motion"), ("b", "one motion"), ("c", "one m0tion")):
        (complete / f"data/mine/{name}.bvh").write_text(text)
    message = r'data set mine: b and a are the same file: the first .* Add to held_out: \["a"\]'
    with pytest.raises(HobbleError, match=message):
        check(Project(complete, {}), ["results/one/report.html"])
    check(Project(complete, {}), ["results/datasets/mine/look.html"])
    data = complete / "config/datasets/mine.yaml"
    data.write_text(DATASET.replace("[b]", "[a, b]").replace("mirror: true", ""))
    (complete / "data/mine/a_mirror.bvh").unlink()
    check(Project(complete, {}), ["results/hurt/report.html"])


def test_a_skeleton_that_cannot_be_mirrored_is_reported_before_anything_runs(complete: Path) -> None:
    rig = complete / "config/skeletons/s.yaml"
    rig.write_text(rig.read_text().replace("RightFoot", "OtherFoot"))
    for mirror in (False, True):
        text = DATASET.replace("mirror: true", f"mirror: {str(mirror).lower()}") + "clips: {a: , b: }\n"
        (complete / "config/datasets/mine.yaml").write_text(text)
        if not mirror:
            check(Project(complete, {}), ["results/one/report.html"])
    with pytest.raises(
        HobbleError, match="skeleton s cannot be mirrored: LeftFoot is the left heel and OtherF"
    ):
        check(Project(complete, {}), ["results/one/report.html"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("channels: [injury]", r"its channels must be \[\], not"),
        ("network: {units: 9}", "its network must be .*512.*, not .*9"),
        ("training: {sections: 5}", r"its training\.sections must be 10, not 5"),
        (
            "training: {passes: 19}",
            r"which has 20 passes\. Its training\.passes must not be fewer, but it is 19",
        ),
        ("network: {kind: matching}", "but matching is built and not trained"),
        ("training: {learning_rate: 1.0e-3, batch: 64}", None),
        ("", None),
    ],
)
def test_an_impossible_continuation_is_reported_before_anything_runs(
    complete: Path, text: str, message: str | None
) -> None:
    (complete / "config/more.yaml").write_text("extends: one\ntraining: {passes: 40, continues: one}\n")
    (complete / "config/other.yaml").write_text(f"extends: more\n{text}\n")
    project = Project(complete, {})
    if message is None:
        return check(project, ["results/other/report.html"])
    with pytest.raises(HobbleError, match=f"configuration other continues from one, .*{message}"):
        check(project, ["results/other/report.html"])


def test_every_shipped_data_set_passes(root: Path) -> None:
    project = Project(root, {"mocap": "nowhere"})
    names = ("synthetic", "synthetic-ava", "tiny", "cmu")
    check(project, [f"results/datasets/{name}/x" for name in names])


def test_what_is_compared(complete: Path) -> None:
    base = complete
    project = Project(base, {"compare": ["one", "hurt"]})
    check(project, ["results/compare/compare.json"])
    assert project.comparison.input_files()["accuracy"] == [
        f"results/{n}/evaluation/accuracy.json" for n in ("one", "hurt")
    ]
    assert Project(base, {"compare": "one,hurt"}).comparison.names() == ["one", "hurt"]
    (base / "config/read.yaml").write_text("extends: one\nnetwork_of: one\n")
    read = Project(base, {"compare": ["read"]}).comparison.input_files()
    assert read["history"] == ["results/one/network/history.csv"]
    # The list of compared configurations belongs to none of them.
    assert project.configurations.resolved("one") == Project(base, {}).configurations.resolved("one")


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["one", "two"], "two.yaml: no such file. There are: hurt, one"),
        (["one", "one"], "each once, not one, one"),
        ([], "at least one configuration, each once, not none"),
        ([1], "must be a list of names"),
        ({"a": "one"}, "must be a list of names"),
    ],
)
def test_what_cannot_be_compared(complete: Path, names: object, message: str) -> None:
    project = Project(complete, {"compare": names})
    check(project, ["results/one/report.html"])
    with pytest.raises(HobbleError, match=message):
        check(project, ["results/compare/report.html"])


@pytest.mark.parametrize("name", ["compare", "datasets"])
def test_names_of_results_folders_are_reserved(base: Path, name: str) -> None:
    (base / f"config/{name}.yaml").write_text("extends: one\n")
    with pytest.raises(HobbleError, match=f"no configuration can be called {name}"):
        Project(base, {})


def test_clips_are_found_in_subfolders_and_whatever_the_case_of_their_suffix(base: Path) -> None:
    below = base / "data/mine/takes/day 1"
    below.mkdir(parents=True)
    (below / "d.BVH").write_text("")
    (below / "d_gait.txt").write_text("1 walk\n")
    (below / "d_injuries.txt").write_text("frames:9\n")
    (base / "data/mine/.trash").mkdir()
    (base / "data/mine/.trash/e.bvh").write_text("")
    project = Project(base, {})
    assert list(project.clips.of("mine")) == ["a", "b", "c", "d"]
    assert project.clips.source("mine", "d") == str(below / "d.BVH")
    assert project.clips.label_files("mine", "d") == [str(below / "d_gait.txt")]
    assert project.datasets.channel_sources.files("mine", "d", "injury") == [str(below / "d_injuries.txt")]


def test_clips_are_found_in_linked_folders_once_whatever_leads_there(base: Path) -> None:
    """A linked collection is found once, even if one of its links leads back to it."""
    kept = base / "kept/day 1"
    kept.mkdir(parents=True)
    (kept / "d.bvh").write_text("")
    (kept / "d_injuries.txt").write_text("frames:9\n")
    (kept / "back").symlink_to(base / "data/mine")
    for name in ("first", "second"):
        (base / f"data/mine/{name}").symlink_to(base / "kept")
    (base / "data/mine/gone").symlink_to(base / "nowhere")
    project = Project(base, {})
    assert list(project.clips.of("mine")) == ["a", "b", "c", "d"]
    assert project.clips.source("mine", "d") == str(base / "data/mine/first/day 1/d.bvh")
    assert project.datasets.channel_sources.files("mine", "d", "injury") == [
        str(base / "data/mine/first/day 1/d_injuries.txt")
    ]


@pytest.mark.parametrize("mirror", [True, False])
def test_a_mirror_beside_its_original_is_left_out(base: Path, mirror: bool) -> None:
    text = DATASET.replace("mirror: true", f"mirror: {str(mirror).lower()}")
    (base / "config/datasets/mine.yaml").write_text(text)
    (base / "data/mine/a_mirror_footsteps.txt").write_text("1 2\n")
    clips = Project(base, {}).clips
    assert list(clips.of("mine")) == ["a", "b", "c"]
    said = [] if mirror else ["1 files in .* are mirrors of other clips .a_mirror.*`mirror: true` Hobble m"]
    assert all(re.search(wanted, note) for wanted, note in zip(said, clips.notes("mine"), strict=True))
    (base / "data/mine/a_mirror.bvh").rename(base / "data/mine/z_mirror.bvh")
    with pytest.raises(HobbleError, match=r"z_mirror: names that end in _mirror are .* `mirror: true` makes"):
        Project(base, {}).clips.of("mine")


def test_a_status_file_without_a_clip_is_reported_with_the_nearest_name(base: Path) -> None:
    (base / "data/mine/orphan.bvh").write_text("")
    (base / "data/mine/orphn_injuries.txt").write_text("frames:9\n1-9 LeftLeg-LeftFoot[4];\n")
    (note,) = notes(Project(base, {}), ["results/one/report.html", "results/hurt/report.html"])
    assert note.startswith("data set mine: ")
    assert (
        "orphn_injuries.txt belongs to no clip and is not read. If it belongs to orphan, rename it." in note
    )


def test_two_files_of_one_clip_are_refused_with_both(base: Path) -> None:
    (base / "data/mine/old").mkdir()
    (base / "data/mine/old/a.BVH").write_text("")
    with pytest.raises(HobbleError, match=r"old/a\.BVH: a second file of clip a; the first is .*mine/a\.bvh"):
        Project(base, {}).clips.of("mine")
    (base / "config/datasets/mine.yaml").write_text(DATASET + "clips: {a: , b: , c: }\n")
    with pytest.raises(HobbleError, match="a second file of clip a"):
        Project(base, {}).clips.source("mine", "a")
    assert Project(base, {}).clips.source("mine", "b").endswith("mine/b.bvh")


FAR = """
skeleton: s
folder: far
download: {url: 'https://host/{subject:0>3}/{clip}.bvh', checksums: far.sha256}
"""


def test_missing_clips_are_downloaded(base: Path) -> None:
    (base / "config/datasets/far.yaml").write_text(FAR + "clips: {'2_1': , '2_2': , '2_3': }\n")
    (base / "config/datasets/far.sha256").write_text(f"{'a' * 64}  2_1.bvh\n{'B' * 64} *2_2.bvh\n\n")
    project = Project(base, {})
    assert project.clips.source("far", "2_1") == str(base / "data/downloaded/far/2_1.bvh")
    assert (
        project.clips.label_files("far", "2_1")
        == project.datasets.channel_sources.files("far", "2_1", "injury")
        == []
    )
    assert project.clips.download("far", "2_2") == {
        "url": "https://host/002/2_2.bvh",
        "sha256": "b" * 64,
        "folder": str(base / "data/far"),
    }
    with pytest.raises(
        HobbleError, match=r"far/2_3\.bvh: no such file, .*not in the download list .*far\.sha256"
    ):
        project.clips.source("far", "2_3")
    (base / "data/far").mkdir()
    (base / "data/far/2_1.bvh").write_text("")
    assert Project(base, {}).clips.source("far", "2_1") == str(base / "data/far/2_1.bvh")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("https://host/", "ftp://host/", r"download: url: must be an address like"),
        ("{clip}", "{name}", r"download: url: 'name'"),
        ("{clip}", "a", r"download: url: must contain \{clip\}"),
        ("{clip}", "{clip.x}", "download: url: "),
        ("{clip}", "{clip:a>400000000}", "only a width of up to 99 may follow a name"),
        ("{clip}", "{clip:{subject}}", "only a width of up to 99"),
        ("{clip}", "{clip!r}", "only a width of up to 99"),
        ("https://host/", "https://host/\u202e", "must be an address like"),
        ("{clip}", "{clip", "download: url: "),
        ("far.sha256", "../far.sha256", "checksums: must be relative"),
        ("clips: {'2_1': }\n", "", "lists them and names a `folder`"),
    ],
)
def test_a_bad_address_is_reported(base: Path, old: str, new: str, message: str) -> None:
    (base / "config/datasets/far.yaml").write_text((FAR + "clips: {'2_1': }\n").replace(old, new))
    with pytest.raises(HobbleError, match=message):
        Project(base, {}).catalogue.dataset("far")


def test_a_bad_checksum_list_is_reported_with_its_line(base: Path) -> None:
    (base / "config/datasets/far.yaml").write_text(FAR + "clips: {'2_1': }\n")
    (base / "config/datasets/far.sha256").write_text(f"{'a' * 64}  2_1.bvh\n{'a' * 63}  2_2.bvh\n")
    with pytest.raises(HobbleError, match=r"far\.sha256, line 2: expected a SHA-256"):
        Project(base, {}).clips.source("far", "2_1")


def test_every_clip_of_the_cmu_set_has_a_checksum_and_an_address(root: Path) -> None:
    project = Project(root, {"mocap": "nowhere"})
    check(project, ["results/datasets/cmu/motion/02_01.npz"])
    assert len(project.clips.listed("cmu")) == 69
    assert project.clips.download("cmu", "02_01")["url"].endswith("/cmu-mocap/master/data/002/02_01.bvh")
    assert project.clips.download("cmu", "105_16")["url"].endswith("/105/105_16.bvh")
    assert all(
        len(project.clips.download("cmu", clip)["sha256"]) == 64 for clip in project.clips.listed("cmu")
    )


@pytest.mark.shared
def test_the_checksums_are_those_of_the_files(root: Path, shared: Path) -> None:
    import hashlib

    project = Project(root, {})
    for clip in project.clips.listed("cmu"):
        data = (shared / f"mocap/cmu/{clip}.bvh").read_bytes()
        assert project.clips.download("cmu", clip)["sha256"] == hashlib.sha256(data).hexdigest()


def test_a_clip_depends_on_the_skeleton_that_it_is_retargeted_from(complete: Path, root: Path) -> None:
    shutil.copy(root / "config/skeletons/mixamo55.yaml", complete / "config/skeletons")
    joints = ("Hips", "Spine2", "LeftHandThumb1", "LeftHandThumb2", "LeftUpLeg")
    header = (
        "HIERARCHY\n" + "".join(f"JOINT mixamorig:{name}{{\r\n" for name in joints) + "MOTION\nJOINT Neck1\n"
    )
    (complete / "data/mine/b.bvh").write_text(header)
    project = Project(complete, {})
    assert [Path(f).name for f in project.clips.rig_files("mine", "b")] == ["mixamo55.yaml"]
    assert project.clips.rig_files("mine", "a") == []
    shipped = Project(root, {}).clips
    assert [Path(f).name for f in shipped.rig_files("synthetic-ava", "walk-1")] == ["holden31.yaml"]
    assert shipped.rig_files("synthetic", "walk-1") == []


@pytest.mark.shared
def test_the_plan_and_the_job_agree_on_the_rig(root: Path, shared: Path) -> None:
    from hobble.motion.make import load_source
    from hobble.motion.read import read_bvh
    from hobble.motion.rig import load_skeleton

    project = Project(root, {"mocap": str(shared / "mocap")})
    target = load_skeleton(root / "config/skeletons/holden31.yaml")
    options = ClipMotion()
    for clip in ("Injured_Ilde", "Injured_Walk_LLL", "Injured_Run_LLL_extended_converted"):
        file = read_bvh(project.clips.source("ferre", clip))
        rig = load_source(file, target, root / "config/skeletons", options).match.rig
        assert [Path(f).stem for f in project.clips.rig_files("ferre", clip)] == [rig] * (rig != "holden31")


def test_motion_knows_what_the_clip_s_entry_says_of_it(root):
    datasets = Project(root, {}).datasets
    assert datasets.motion_options("cmu", "03_01")["ground"] == "rocky"
    assert datasets.motion_options("cmu", "02_01") == {**datasets.options("cmu", "motion"), "ground": "flat"}


@pytest.mark.parametrize("asked", [5, "", " ", ["a"], {"a": 1}, None, True])
def test_a_mocap_that_is_not_a_folder_is_reported(base: Path, asked: object) -> None:
    with pytest.raises(HobbleError, match="--config mocap: must be the name of one folder"):
        Project(base, {"mocap": asked})


def test_sections_may_be_asked_for_some_of_their_keys(root: Path) -> None:
    project = Project(root, {})
    assert project.datasets.options("tiny", "database", "window", "step") == {"window": 60, "step": 10}
    with pytest.raises(KeyError):
        project.configurations.section("test", "training", "passes", "learning_rat")


@pytest.mark.parametrize("name", ["a.bvh", "map.txt"])
def test_a_pipe_is_refused_as_a_clip(base: Path, name: str) -> None:
    """A pipe is refused during planning, because Snakemake would wait for its end."""
    text = DATASET + "terrain: {heightmaps: [{kind: file, path: mine/map.txt}]}\n"
    (base / "config/datasets/mine.yaml").write_text(text)
    (base / f"data/mine/{name}").unlink(missing_ok=True)
    os.mkfifo(base / f"data/mine/{name}")
    clips = Project(base, {}).clips
    with pytest.raises(HobbleError, match=f"mine/{name}: a device or a pipe, not a file"):
        (clips.of if name == "a.bvh" else clips.heightmap_files)("mine")
    listed = text + "clips: {a: , b: }\n"
    (base / "config/datasets/mine.yaml").write_text(listed)
    if name == "a.bvh":
        with pytest.raises(HobbleError, match=f"mine/{name}: a device or a pipe"):
            Project(base, {}).clips.source("mine", "a")
