"""Wrong data sets, targets and continuations are reported before anything runs."""

import contextlib
from pathlib import Path

import pytest

from hobble.core.errors import HobbleError
from hobble.workflow import project as targets
from hobble.workflow.project import Project, check_targets
from tests.workflow.small_project import DATASET

IMPOSSIBLE = {
    DATASET + "clips: {b: , a_mirror: }\n": "a_mirror: names that end in _mirror, .* are reserved",
    DATASET.replace("[b]", "[z]"): "held_out names clips that do not exist: z",
    DATASET.replace("[b]", "[a, b, c]"): "no clip without injury is left to train on",
    "skeleton: s\nfolder: empty\n": "empty: no such folder",
}


@pytest.mark.parametrize("text", IMPOSSIBLE)
def test_an_impossible_data_set_is_reported(base: Path, text: str) -> None:
    (base / "config/datasets/mine.yaml").write_text(text)
    with pytest.raises(HobbleError, match=IMPOSSIBLE[text]):
        _ = Project(base, {}).configuration("one").splits


@pytest.fixture
def unchecked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Data sets are not checked, because their clips hold nothing."""
    monkeypatch.setattr(targets, "_check_dataset", lambda *_: None)


def test_impossible_targets_are_reported_before_training(base: Path, unchecked: None) -> None:
    (base / "config/eyes.yaml").write_text("extends: hurt\nnetwork_of: one\n")
    questionnaire = "questionnaire/questionnaire.html"
    for target, message in {
        "results/one/stimuli": "configuration one has no `channels`",
        f"results/one/{questionnaire}": r"configuration one has no channel injury.*\[injury\]",
    }.items():
        with pytest.raises(HobbleError, match=message):
            check_targets(Project(base, {}), [target])
    fine = ("hurt/stimuli", f"hurt/{questionnaire}", "one/export/pfnn")
    check_targets(Project(base, {}), [f"results/{target}" for target in fine])


SYMMETRIC = "training: {symmetric: true}\n"
LOCAL = DATASET + "database: {local_phases: true}\n"


@pytest.mark.parametrize(
    ("text", "dataset", "message"),
    [
        (SYMMETRIC + "network: {kind: mann}", DATASET, "lame: training.symmetric: a network of kind mann"),
        (SYMMETRIC + "network: {control_points: 5}", DATASET, "it needs an even number of .*, not 5"),
        (
            SYMMETRIC,
            DATASET.replace("mirror: true\n", ""),
            "data set mine has no mirrored clips.* `mirror",
        ),
        (SYMMETRIC + "network: {kind: plain}", DATASET, ""),
        ("network: {kind: local}", DATASET, "local needs local phases, and data set mine has none.*s: true}"),
        (
            "network: {kind: mann}",
            LOCAL,
            "mann cannot use local phases, and data set mine has them.*false}",
        ),
        ("network: {kind: local}", LOCAL, ""),
    ],
)
def test_a_data_set_has_what_the_network_needs(
    base: Path, unchecked: None, text: str, dataset: str, message: str
) -> None:
    (base / "config/datasets/mine.yaml").write_text(dataset)
    (base / "config/lame.yaml").write_text(f"dataset: mine\n{text}\n")
    with pytest.raises(HobbleError, match=message) if message else contextlib.nullcontext():
        check_targets(Project(base, {}), ["results/lame/report.html"])


LISTED = "skeleton: s\nfolder: mine\nclips: {a: , b: {%s}}\n"
WALKER = "skeleton: s\nsynthetic: {frames: 600}\nclips: {b: {%s}}\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            LISTED % "channels: {injury: 'LeftLeg-LeftFoot[11]'}",
            "clips.b.channels.injury: severity 11 of LeftLeg-LeftFoot is not a number from 0",
        ),
        (
            LISTED % "channels: {injury: 'LeftLeg-NoSuch[4]'}",
            "no such link: LeftLeg-NoSuch. Did you mean LeftLeg-LeftFoot",
        ),
        (LISTED % "channels: {injury: ''}", "clips.b.channels.injury: names no link"),
        (WALKER % "recipe: wlak", "clips.b.recipe: no such recipe: wlak. There are walk-straight, walk, "),
    ],
)
def test_wrong_names_in_clip_entries_are_reported_before_anything_runs(
    complete: Path, text: str, message: str
) -> None:
    (complete / "config/datasets/mine.yaml").write_text(text)
    with pytest.raises(HobbleError, match=f"data set mine: .*{message}"):
        check_targets(Project(complete, {}), ["results/one/report.html"])


def test_a_skeleton_that_cannot_be_mirrored_is_reported_before_anything_runs(complete: Path) -> None:
    rig = complete / "config/skeletons/s.yaml"
    rig.write_text(rig.read_text().replace("RightFoot", "OtherFoot"))
    for mirror in (False, True):
        text = DATASET.replace("mirror: true", f"mirror: {str(mirror).lower()}") + "clips: {a: , b: }\n"
        (complete / "config/datasets/mine.yaml").write_text(text)
        if not mirror:
            check_targets(Project(complete, {}), ["results/one/report.html"])
    with pytest.raises(
        HobbleError, match="skeleton s cannot be mirrored: LeftFoot is the left heel and OtherF"
    ):
        check_targets(Project(complete, {}), ["results/one/report.html"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("channels: [injury]", r"its channels must be \[\], not"),
        ("training: {sections: 5}", r"its training\.sections must be 10, not 5"),
        ("training: {passes: 19}", r"its training\.passes must be 20 or more, not 19"),
        ("network: {kind: matching}", "so its network must be"),
        ("training: {learning_rate: 1.0e-3, batch: 64}", None),
        ("", None),
    ],
)
def test_an_impossible_continuation_is_reported_before_anything_runs(
    complete: Path, text: str, message: str | None
) -> None:
    (complete / "config/more.yaml").write_text("extends: one\ntraining: {passes: 40, continues: one}\n")
    (complete / "config/other.yaml").write_text(f"extends: more\n{text}\n")
    refused = pytest.raises(HobbleError, match=f"configuration other continues from one, .*{message}")
    with refused if message else contextlib.nullcontext():
        check_targets(Project(complete, {}), ["results/other/report.html"])


def test_every_shipped_data_set_passes(root: Path) -> None:
    project = Project(root, {"mocap": "nowhere"})
    names = ("synthetic", "synthetic-ava", "tiny", "cmu")
    check_targets(project, [f"results/datasets/{name}/x" for name in names])
